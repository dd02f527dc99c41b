"""Publishes the scans of a simulated lidar as its driver does."""

from array import array

from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import create_steady_timer
from nodlidar_sim.devices.driven_lidar import DrivenLidar
from nodlidar_sim.devices.other_lidars import Published
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan

_PERIOD = 0.005  # at which the node looks for scans [s]


class ScanPublisher:
    """Lets a node publish the scans of a lidar on `scan`.

    Parameters
    ----------
    node
        The node.
    lidar
        The lidar, which another thread serves.
    frame_id
        Of the scans.
    """

    def __init__(self, node: Node, lidar: DrivenLidar, frame_id: str) -> None:
        best_effort = lidar.lidar.best_effort
        policy = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
        qos = QoSProfile(depth=10, reliability=policy)
        self._scans, self._frame_id = lidar.scans, frame_id
        self._publisher = node.create_publisher(
            LaserScan, 'scan', qos, qos_overriding_options=OVERRIDABLE
        )
        create_steady_timer(node, _PERIOD, self.publish)

    def publish(self) -> None:
        """Publish the scans that have come."""
        while self._scans:
            self._publisher.publish(scan_message(self._scans.popleft(), self._frame_id))


def scan_message(scan: Published, frame_id: str) -> LaserScan:
    """Return the message of a scan."""
    values = scan._asdict() | {'ranges': array('f', scan.ranges.tobytes())}
    stamp = time_message(values.pop('stamp_ns'))
    message = LaserScan(**values)
    message.header.frame_id, message.header.stamp = frame_id, stamp
    return message
