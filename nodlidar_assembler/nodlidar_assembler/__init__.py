"""Turns the scans of a nodding lidar and its joint states into point clouds.

Without ROS: config, geometry, pitch, points, assembly, turns, sweeps, nod_start.
With it: node, bracket_filter, joint_filter, cloud_message.
"""
