"""From what must be found to the nod: scan pattern, coverage and the choice of N_s, without ROS."""
