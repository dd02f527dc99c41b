"""A joint that ros2_control moves."""
