"""Drives of a robot: maps, level scans, odometry, SLAM."""
