"""Drivers of Hokuyo lidars of SCIP 2.0 and of LDROBOT's LD06 and LD19, to LaserScan."""
