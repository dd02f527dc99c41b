"""What the viewer subscribes to while a browser is connected."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path
from nodlidar_common.ros.polled import PolledSubscription
from nodlidar_msgs.msg import Coverage
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import String

CLOUDS, SCANS, COVERAGE = 'points', 'scan', 'assembler/coverage'
MODEL, MAP, PATH = 'robot_description', 'map_cloud', 'path'
DIAGNOSTICS = '/diagnostics'
RATED = (CLOUDS, SCANS)  # topics whose rate is shown

_LATEST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# A slow connection to a page must not slow down the publishers.
# Between two pictures, 1 s at most, a UST sends 40 scans.
_STREAM = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)

TOPICS: dict[str, tuple[Any, QoSProfile]] = {
    CLOUDS: (PointCloud2, _STREAM),
    SCANS: (LaserScan, _STREAM),
    COVERAGE: (Coverage, QoSProfile(depth=1)),
    MODEL: (String, _LATEST),
    MAP: (PointCloud2, _LATEST),
    PATH: (Path, _LATEST),
    DIAGNOSTICS: (DiagnosticArray, QoSProfile(depth=50)),
}


class Inputs:
    """Subscribes to all topics of the page."""

    def __init__(self, node: Node) -> None:
        self._subscriptions = {
            topic: PolledSubscription(node, message_type, topic, qos)
            for topic, (message_type, qos) in TOPICS.items()
        }
        self._counts = dict.fromkeys(RATED, 0)

    def take(self, topic: str) -> list[Any]:
        """Return the messages of a topic since the last call, the oldest first."""
        messages = self._subscriptions[topic].take()
        if topic in self._counts:
            self._counts[topic] += len(messages)
        return messages

    def new_counts(self) -> dict[str, int]:
        """Return the number of messages of the topics in RATED since the last call."""
        counts, self._counts = self._counts, dict.fromkeys(RATED, 0)
        return counts

    def end(self) -> None:
        """End all subscriptions."""
        for subscription in self._subscriptions.values():
            subscription.end()
