"""The nodding lidar simulated, down to the bytes of its two devices, without ROS."""
