"""What needs ROS: running the launch file, and recording what it publishes."""
