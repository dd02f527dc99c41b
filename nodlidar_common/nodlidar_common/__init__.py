"""What several nodlidar packages share.

Without ROS: errors, nod, parameters, serial_port. With it: messages, node, node_parameters.
"""
