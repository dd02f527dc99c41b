"""Publishes level scans as LaserScan messages."""

from nodlidar_assembler.clouds.level_scan import (
    level_frame,
    LevelScan,
    LevelScanner,
    message_fields,
)
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import time_message, transform_message
from nodlidar_common.ros.qos import OVERRIDABLE
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from tf2_ros import StaticTransformBroadcaster


class LevelScanPublisher:
    """Publishes `level_scan`, in a frame that is static to the robot, and level if the robot is.

    If frame_id is tilted, the frame is published on /tf_static.
    """

    def __init__(self, node: Node, config: AssemblerConfig) -> None:
        self._config, self.scanner = config, LevelScanner(config)
        frame, now_ns = level_frame(config.frame_id, config), node.get_clock().now().nanoseconds
        if frame != config.frame_id:
            level = Pose(np.zeros(3), config.levelled.T)
            self._broadcaster = StaticTransformBroadcaster(node)
            self._broadcaster.sendTransform(
                transform_message(now_ns, config.frame_id, frame, level)
            )
        self._publisher = node.create_publisher(
            LaserScan, 'level_scan', 10, qos_overriding_options=OVERRIDABLE
        )

    def add(self, assembled: Assembled) -> None:
        """Add a scan, and publish the level scans that it completes."""
        for scan in self.scanner.add(assembled):
            range_min = assembled.scan.geometry.range_min
            self._publisher.publish(_message(scan, self._config, range_min))


def _message(scan: LevelScan, config: AssemblerConfig, range_min: float) -> LaserScan:
    message = LaserScan(**message_fields(scan, config, range_min))
    message.header.frame_id = level_frame(config.frame_id, config)
    message.header.stamp = time_message(scan.stamp_ns)
    message.ranges.frombytes(scan.ranges.tobytes())
    return message
