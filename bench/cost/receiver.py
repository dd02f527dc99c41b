"""A node that receives the assembler's messages and ignores them: the cost of rclpy alone."""

import sys

from nodlidar_common.ros.node import run
from rclpy.node import Node
from sensor_msgs.msg import JointState, LaserScan


class Receiver(Node):
    """Subscribes to scans and joint states."""

    def __init__(self) -> None:
        super().__init__('receiver')
        self.create_subscription(LaserScan, 'scan', lambda scan: None, 10)
        self.create_subscription(JointState, 'joint_states', lambda state: None, 50)


if __name__ == '__main__':
    sys.exit(run(Receiver))
