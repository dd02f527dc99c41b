"""The mapper as a ROS node."""
