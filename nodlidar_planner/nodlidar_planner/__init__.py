"""From what must be found to the nod: scan pattern, coverage, the choice of N_s. No ROS."""
