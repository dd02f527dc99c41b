"""Recorded scans, joint states and odometry to clouds in files, without a ROS graph."""
