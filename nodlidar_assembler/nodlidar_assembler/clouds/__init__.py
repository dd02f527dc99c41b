"""From scans and joint samples to clouds: pitch, pose and end point of every beam. No ROS."""
