"""What the launch file is made of, and the launch file as a child process."""
