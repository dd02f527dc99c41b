"""What the launch files are made of, and the command doctor."""
