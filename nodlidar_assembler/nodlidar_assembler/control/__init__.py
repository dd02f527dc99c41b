"""The nod, which NodController owns, and what it is chosen by. No ROS."""
