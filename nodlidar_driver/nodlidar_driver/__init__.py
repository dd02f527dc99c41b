"""Driver of the Hokuyo URG-04LX-UG01: SCIP 2.0 over a serial port to LaserScan."""
