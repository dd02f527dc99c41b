"""Turns the scans of a nodding lidar and its joint states into point clouds."""
