"""LDROBOT's LD06 and LD19: packets, revolutions, and the lidar as a whole."""
