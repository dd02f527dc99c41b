"""Which nod to command: tied to the lidar, by what is around and what was not seen yet. No ROS."""
