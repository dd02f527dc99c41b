"""The nod to command: phase lock, limits by the range ahead, sweeps for unseen cells. No ROS."""
