"""The ros2 command line."""
