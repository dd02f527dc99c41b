"""What several nodlidar packages share.

Without ROS: errors, nod, parameters, pose, serial_port. With it: messages, node, node_parameters.
"""
