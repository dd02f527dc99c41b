"""Records a running sensor into an MCAP bag: serialized messages at their publication times."""

from collections import Counter
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from nodlidar_msgs.msg import NodCommand
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from sensor_msgs.msg import JointState, LaserScan, PointCloud2, TimeReference
from tf2_msgs.msg import TFMessage

TOPICS = {
    'scan': LaserScan,
    'joint_states': JointState,
    'points': PointCloud2,
    'nod_command': NodCommand,
    'driver/arrival': TimeReference,
    'odom': Odometry,
    'base/start': TimeReference,
    '/diagnostics': DiagnosticArray,
    '/tf': TFMessage,
    '/tf_static': TFMessage,
}
LATCHED = {'base/start', '/tf_static'}
NO_LIMIT = QosTime(9223372036, 854775807)


class Recorder(Node):
    """Subscribes to the topics of a sensor and writes their messages into a bag.

    Parameters
    ----------
    bag
        Folder to create.
    best_effort
        Take scans of a publisher that is not reliable.

    Attributes
    ----------
    counts
        Messages written so far, by topic.
    """

    def __init__(self, bag: Path, best_effort: bool = False) -> None:
        super().__init__('recorder')
        self.counts: Counter[str] = Counter()
        self._best_effort = {'scan'} if best_effort else set()
        self._assembler = AsyncParameterClient(self, 'assembler')
        self._writer = Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        types = get_typestore(Stores.ROS2_JAZZY)
        types.register(_nod_command_type())
        for topic, message_type in TOPICS.items():
            self._record(topic, message_type, types)

    def complete(self) -> bool:
        """Return whether scans, joint states and clouds arrive; DDS finds topics one by one."""
        return all(self.counts[topic] for topic in ('scan', 'joint_states', 'points'))

    def adapt_limits(self) -> None:
        """Let the limits of the nod follow the range from now on."""
        self._assembler.set_parameters([Parameter('adapt_limits', value=True)])

    def close(self) -> None:
        """Finish the bag."""
        self._writer.close()

    def _record(self, topic: str, message_type: Any, types: Any) -> None:
        package = message_type.__module__.split('.')[0]
        latched = topic in LATCHED
        connection = self._writer.add_connection(
            self.resolve_topic_name(topic),
            f'{package}/msg/{message_type.__name__}',
            typestore=types,
            offered_qos_profiles=[_bag_qos(latched)],
        )

        def write(data: bytes, info: dict[str, int]) -> None:
            self._writer.write(connection, info['source_timestamp'], data)
            self.counts[topic] += 1

        qos = QoSProfile(depth=100)
        if latched:
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        if topic in self._best_effort:
            qos.reliability = ReliabilityPolicy.BEST_EFFORT
        self.create_subscription(message_type, topic, write, qos, raw=True)


def _nod_command_type() -> Any:
    """Return the type, with the definition that a reader without nodlidar_msgs needs."""
    definition = Path(get_package_share_directory('nodlidar_msgs')) / 'msg' / 'NodCommand.msg'
    return get_types_from_msg(definition.read_text(), 'nodlidar_msgs/msg/NodCommand')


def _bag_qos(latched: bool) -> Qos:
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    return Qos(
        QosHistory.KEEP_LAST,
        100,
        QosReliability.RELIABLE,
        durability,
        NO_LIMIT,
        NO_LIMIT,
        QosLiveliness.AUTOMATIC,
        NO_LIMIT,
        False,
    )
