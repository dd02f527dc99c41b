"""Watches the running system: nodes, topics, messages and transforms."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nodlidar_bringup.checks.diagnostics import Status
from nodlidar_bringup.checks.graph import Endpoint, Graph, SOURCES, Topic
from nodlidar_bringup.checks.traffic import Content, HOST, SIMULATED, Traffic
from nodlidar_common.arrays import Array, Mask
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand
import numpy as np
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from tf2_msgs.msg import TFMessage

TYPES = {'scan': LaserScan, 'joint_states': JointState, 'points': PointCloud2}
# A subscription that any publisher satisfies.
LISTENING = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
KEPT = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Share of the time in which a topic is found; a first message after it is of a slow topic.
LATEST_FIRST = 0.5
_MOST_POINTS = 60_000


class SystemWatch:
    """Listens to a sensor until `listen` returns.

    Parameters
    ----------
    node
        The node that listens, in the namespace of the sensor.

    Attributes
    ----------
    parents
        The parents of each frame.
    transforms
        The latest transform to each frame.
    sweep_duration
        Of the nod that is commanded [s]; None until a command was heard.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        # Each message with its arrival by this computer's clock [ns], and by /clock minus that.
        self._arrivals: dict[str, list[tuple[int, int, Any]]] = defaultdict(list)
        self._clock_ahead_ns = 0
        node.create_subscription(Clock, '/clock', self._ticked, LISTENING)
        self.parents: dict[str, set[str]] = defaultdict(set)
        self.transforms: dict[str, Any] = {}
        self._statuses: dict[str, Status] = {}
        for name, kind in TYPES.items():
            node.create_subscription(kind, name, self._keeper(name), LISTENING)
        self.sweep_duration: float | None = None
        node.create_subscription(NodCommand, 'nod_command', self._commanded, LISTENING)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._reported, 20)
        for topic in {'/tf', 'tf'}:
            node.create_subscription(TFMessage, topic, self._transformed, LISTENING)
        for topic in {'/tf_static', 'tf_static'}:
            node.create_subscription(TFMessage, topic, self._transformed, KEPT)
        self._seconds, self._end_ns = 0.0, time.time_ns()

    def listen(self, seconds: float) -> None:
        """Take messages for some time [s]."""
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        begin = time.monotonic()
        while (left := begin + seconds - time.monotonic()) > 0.0:
            executor.spin_once(timeout_sec=left)
        self._seconds += seconds
        self._end_ns = time.time_ns()
        executor.remove_node(self._node)

    def _keeper(self, name: str) -> Any:
        kept = self._arrivals[name]
        return lambda message: kept.append((time.time_ns(), self._clock_ahead_ns, message))

    def _ticked(self, message: Clock) -> None:
        self._clock_ahead_ns = time_ns(message.clock) - time.time_ns()

    def _commanded(self, message: NodCommand) -> None:
        self.sweep_duration = message.sweep_duration

    def _transformed(self, message: TFMessage) -> None:
        for transform in message.transforms:
            self.parents[transform.child_frame_id].add(transform.header.frame_id)
            self.transforms[transform.child_frame_id] = transform.transform

    def _reported(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = int.from_bytes(status.level, 'little')
            self._statuses[status.name] = Status(status.name, level, status.message)

    @property
    def _namespace(self) -> str:
        return str(self._node.get_namespace()).rstrip('/')

    @property
    def statuses(self) -> tuple[Status, ...]:
        """The latest status of each name."""
        return tuple(self._statuses[name] for name in sorted(self._statuses))

    def graph(self, on_sim_time: Iterable[str] = ()) -> Graph:
        """Return nodes and topics as they are now."""
        own = self._node.get_name()
        nodes = tuple(
            f'{space.rstrip("/")}/{name}'
            for name, space in self._node.get_node_names_and_namespaces()
            if name != own and not name.startswith('_')
        )
        topics = tuple(self._topic(name) for name in SOURCES)
        clock = self._node.count_publishers('/clock') > 0
        return Graph(nodes, topics, tuple(on_sim_time), clock, self._namespace)

    def has_other_joints(self, joint_name: str) -> bool:
        """Return whether some joint states have a joint, and others do not."""
        return 0 < len(self._came('joint_states', joint_name)) < len(self._came('joint_states'))

    def _came(self, name: str, joint_name: str = '') -> list[tuple[int, int, Any]]:
        """Return the messages of a topic: of joint states those with a joint, if one is given."""
        came = self._arrivals[name]
        if name != 'joint_states' or not joint_name:
            return came
        return [each for each in came if joint_name in each[-1].name]

    def _topic(self, name: str) -> Topic:
        full = self._node.resolve_topic_name(name)
        own = self._node.get_name()
        publishers = self._node.get_publishers_info_by_topic(full)
        subscriptions = self._node.get_subscriptions_info_by_topic(full)
        others = [info for info in subscriptions if info.node_name != own]
        types = {info.topic_type for info in [*publishers, *others]}
        return Topic(
            name,
            tuple(map(_endpoint, publishers)),
            tuple(map(_endpoint, others)),
            tuple(sorted(types)),
        )

    def traffic(
        self, name: str, lasts: float = 0.0, on_sim_time: bool = False, joint_name: str = ''
    ) -> Traffic:
        """Return the messages of a topic, of which each lasts for some time [s].

        On simulated time, their ages are by /clock. Joint states count with that joint only, if
        any have it.
        """
        came = self._came(name, joint_name) or self._arrivals[name]
        stamps = [time_ns(message.header.stamp) for *_, message in came]
        arrivals = [arrival for arrival, *_ in came]
        by_clock = [arrival + ahead * on_sim_time for arrival, ahead, _ in came]
        stamped = [(a, s) for a, s in zip(by_clock, stamps, strict=True) if s]
        steps = np.diff([stamp for _, stamp in stamped]) * 1e-9
        published = self._node.count_publishers(self._node.resolve_topic_name(name)) > 0
        return Traffic(
            name,
            watched(arrivals, self._end_ns, self._seconds),
            [(arrival - stamp) * 1e-9 for arrival, stamp in stamped],
            steps.tolist(),
            len(came) - len(stamped),
            frozenset(message.header.frame_id for *_, message in came),
            published,
            self._namespace,
            lasts,
            SIMULATED if on_sim_time else HOST,
        )

    def content(self, joint_name: str) -> Content:
        """Return what scans and joint states say."""
        scans = [message for *_, message in self._arrivals['scan'] if _has_ranges(message)]
        valid = [float(np.mean(seen(scan))) for scan in scans]
        names: set[str] = set()
        positions = []
        for *_, state in self._arrivals['joint_states']:
            names.update(state.name)
            if joint_name in state.name:
                index = list(state.name).index(joint_name)
                given = index < len(state.position)
                positions.append(float(state.position[index]) if given else math.nan)
        share = float(np.mean(valid)) if valid else None
        followed = bool(self._topic('nod_command').subscriptions)
        return Content(share, joint_name, frozenset(names), positions, self._namespace, followed)

    def points(self, frame: str) -> Array:
        """Return points in a frame, of evenly many clouds if there are many, shape (n, 3)."""
        came = [message for *_, message in self._arrivals['points']]
        clouds = [coordinates(each) for each in came if each.header.frame_id == frame]
        every = max(math.ceil(sum(map(len, clouds)) / _MOST_POINTS), 1)
        return np.concatenate([np.zeros((0, 3)), *clouds[::every]])


def _has_ranges(scan: LaserScan) -> bool:
    """Return whether any range can be within the limits that a scan states."""
    return bool(len(scan.ranges)) and not scan.range_min > scan.range_max


def watched(arrivals: Sequence[int], end_ns: int, seconds: float) -> float:
    """Return how long a topic was watched [s]: from its first message on, if that came early.

    Parameters
    ----------
    arrivals, end_ns
        Of its messages, and when listening ended [ns].
    seconds
        How long everything was listened to [s].
    """
    if not arrivals:
        return seconds
    return max((end_ns - arrivals[0]) * 1e-9, LATEST_FIRST * seconds)


def seen(scan: LaserScan) -> Mask:
    """Return which beams have a range; a driver may send 0 for lost ones."""
    ranges = np.asarray(scan.ranges)
    return np.asarray((ranges >= scan.range_min) & (ranges <= scan.range_max))


def _endpoint(info: Any) -> Endpoint:
    return Endpoint(
        f'{info.node_namespace.rstrip("/")}/{info.node_name}',
        info.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT,
        info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
