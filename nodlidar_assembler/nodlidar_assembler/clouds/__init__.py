"""From scans and joint samples to clouds: pitch, pose and place of every beam. No ROS."""
