"""Calibration from a static scene, without a target and without ROS."""
