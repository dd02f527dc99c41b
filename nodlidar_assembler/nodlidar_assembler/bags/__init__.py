"""Recorded scans, joint states and odometry into files of clouds, without a ROS graph."""
