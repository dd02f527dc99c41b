"""Messages as checked values, and signs that scans, joint samples or odometry are wrong."""
