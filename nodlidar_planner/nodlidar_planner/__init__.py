"""Plans the nod of a nodding lidar: scan pattern, coverage, holes, choice of N_s; no ROS."""
