"""Where the robot is: clouds matched to surfaces, with odometry as prior."""
