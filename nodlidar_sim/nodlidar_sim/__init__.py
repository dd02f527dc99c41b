"""The nodding lidar simulated, without ROS, threads or a clock of its own.

The world: pose, shapes, raycast, scene, base, motion, world. Whole recordings at once: simulation.
"""
