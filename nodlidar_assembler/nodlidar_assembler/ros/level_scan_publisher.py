"""Publishes level scans as LaserScan messages."""

from geometry_msgs.msg import TransformStamped
from nodlidar_assembler.clouds.level_scan import (
    level_frame,
    LevelScan,
    LevelScanner,
    message_fields,
)
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.qos import OVERRIDABLE
import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import LaserScan
from tf2_ros import StaticTransformBroadcaster


class LevelScanPublisher:
    """Publishes `level_scan`, in a frame that is static to the robot, and level if the robot is.

    If frame_id is tilted, the frame is published on /tf_static.
    """

    def __init__(self, node: Node, config: AssemblerConfig) -> None:
        self._config, self.scanner = config, LevelScanner(config)
        if level_frame(config.frame_id, config) != config.frame_id:
            self._broadcaster = StaticTransformBroadcaster(node)
            self._broadcaster.sendTransform(_transform(node, config))
        self._publisher = node.create_publisher(
            LaserScan,
            'level_scan',
            QoSProfile(depth=10),
            qos_overriding_options=OVERRIDABLE,
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


def _transform(node: Node, config: AssemblerConfig) -> TransformStamped:
    """Return the place of the level frame in frame_id."""
    transform = TransformStamped(child_frame_id=level_frame(config.frame_id, config))
    transform.header.frame_id = config.frame_id
    transform.header.stamp = node.get_clock().now().to_msg()
    q = transform.transform.rotation
    q.x, q.y, q.z, q.w = Pose(np.zeros(3), config.levelled.T).quaternion
    return transform
