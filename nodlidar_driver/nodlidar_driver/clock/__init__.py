"""When a scan was taken, by the clocks of lidar and host."""
