"""The commands for `ros2 run`, each in the module of its name."""
