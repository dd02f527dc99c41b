"""Simulates the nodding lidar, down to the bytes of its two devices."""
