"""The servo of the nodding lidar: from a nod command to joint states."""
