"""The servo of the nodding lidar: from a nod command to joint states.

Without ROS: models, dynamixel_bus, latency, sample_time, servo, tracking, servo_loop, config.
With it: node.
"""
