"""What the launch file is made of that needs ROS."""
