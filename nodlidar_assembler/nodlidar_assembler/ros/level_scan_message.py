"""Publishes level scans as LaserScan messages."""

from nodlidar_assembler.clouds.level_scan import LevelScan, LevelScanner, message_fields
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.ros.messages import time_message
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import LaserScan


class LevelScanPublisher:
    """Publishes `level_scan`, in frame_id: static to the robot, and level if the robot is."""

    def __init__(self, node: Node, config: AssemblerConfig) -> None:
        self._config, self.scanner = config, LevelScanner(config)
        self._publisher = node.create_publisher(
            LaserScan,
            'level_scan',
            QoSProfile(depth=10),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def add(self, assembled: Assembled) -> None:
        """Add a scan, and publish the level scans that it completes."""
        for scan in self.scanner.add(assembled):
            range_min = assembled.scan.geometry.range_min
            self._publisher.publish(level_scan_message(scan, self._config, range_min))


def level_scan_message(scan: LevelScan, config: AssemblerConfig, range_min: float) -> LaserScan:
    """Return a level scan as a message."""
    message = LaserScan(**message_fields(scan, config, range_min))
    message.header.frame_id = config.frame_id
    message.header.stamp = time_message(scan.stamp_ns)
    message.ranges.frombytes(scan.ranges.tobytes())
    return message
