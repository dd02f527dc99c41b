"""Clouds that wait for odometry at their stamps."""

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import re

from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.publishers import Publishers
from nodlidar_common.ros.point_cloud import points_in
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.ros.tf_odometry import TfOdometry
from nodlidar_common.silence import Silence
from nodlidar_common.stamps import LATEST_NS, NS_PER_S, time_ns
from nodlidar_common.survival import Survival
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import NodeConfig
from nodlidar_mapper.ros import messages
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2
from tf2_ros import TransformException

MOST_READY = 3  # clouds of a topic that wait to be matched, as after a burst of odometry
MOST_FRAMES = 10  # without transform, that are named; a publisher may invent them
MOST_PAUSES = 20  # of odometry; TF keeps ten seconds
# A cloud this much older than one of another sensor that was used is late, or of another clock.
BEHIND_NS = 2_000_000_000
FIRST_SILENCE = 10.0  # s, after the first cloud; a slow lidar takes 6 s for a sweep
LOST = 'cloud lost before it arrived'
OF_OTHERS = 'cloud of a second publisher'
BUSY = 'cloud that came while others were matched'
BEHIND = 'cloud more than 2 s older than that of another sensor: late, or of another clock'
MALFORMED = 'malformed cloud'
NO_ODOMETRY = 'cloud without odometry at its stamp'
OF_ODOMETRY = 'cloud in the frame of odometry: set ego_motion: deskew in the assembler'


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A cloud, its topic, and when it arrived by the steady clock [ns]."""

    topic: str
    message: PointCloud2
    since_ns: int

    @property
    def stamp_ns(self) -> int:
        return time_ns(self.message.header.stamp)


class CloudInput:
    """Keeps clouds until they can be matched: of those with odometry, each topic's newest ones.

    Parameters
    ----------
    node, config
        Subscribes to the clouds and to TF.
    survival
        Catches errors of the callbacks.
    on_news
        Called when a cloud has arrived.
    on_time_back
        Called when the time of odometry went back; the clouds are dropped.

    Attributes
    ----------
    received
        Number of clouds.
    drops
        Dropped clouds and transforms, counted by reason.
    odometry
        The pose of base_frame in odom_frame.
    silences
        Since the last cloud of each topic, by its full name.
    """

    def __init__(
        self,
        node: Node,
        config: NodeConfig,
        survival: Survival,
        on_news: Callable[[], None],
        on_time_back: Callable[[], None],
    ) -> None:
        self._node, self._config = node, config
        self._delay_ns = round(config.odometry_delay * NS_PER_S)
        self._on_news, self._on_time_back = on_news, on_time_back
        self.received = 0
        self.drops: Counter[str] = Counter()
        self._dropped_ns: tuple[int, int] | None = None  # first and last, since one was used
        self._sources: dict[str, int] = {}  # by topic: the first publisher until it is silent
        self._unknown_frames: set[str] = set()
        self._waiting: list[_Waiting] = []  # in the order of arrival
        self._used_ns: dict[str, int] = {}  # by topic: stamp of the newest cloud that was used
        self._forget_pauses()
        self.odometry = TfOdometry(
            node,
            config.odom_frame,
            config.base_frame,
            self._odometry_came,
            self._time_went_back,
            survival,
            lambda reason: self.drops.update([reason]),
            config.odometry_period,
        )
        topics = config.cloud_topics
        if len({*map(node.resolve_topic_name, topics)}) < len(topics):  # 'points' is '/points'
            raise ParameterError('cloud_topics', 'all different', topics)
        self.silences = dict(self._subscribe(topic) for topic in topics)

    def _subscribe(self, topic: str) -> tuple[str, Silence]:
        silence, publishers = Silence(FIRST_SILENCE), Publishers()
        subscription = self._node.create_subscription(
            PointCloud2,
            topic,
            partial(self._arrived, topic, silence, publishers),
            QoSProfile(depth=5),
            qos_overriding_options=OVERRIDABLE,
        )
        return str(subscription.topic_name), silence

    def next(self) -> Cloud | None:
        """Return the oldest cloud that has odometry, of the newest ones of each topic.

        Those before came while others were matched. They are dropped, as are those that waited for
        odometry too long, and those of which nothing is to be read.
        """
        placed = {
            each: poses
            for each in self._waiting
            if (poses := self._poses_of(each.message)) is not None
        }
        self._drop_overdue([each for each in self._waiting if each not in placed])
        for topic in self._config.cloud_topics:
            for each in [one for one in placed if one.topic == topic][:-MOST_READY]:
                del placed[each]
                self._drop(each, BUSY)
        for each, poses in sorted(placed.items(), key=lambda item: item[0].stamp_ns):
            if cloud := self._read(each, *poses):
                return cloud
        return None

    def _drop_overdue(self, unplaced: list[_Waiting]) -> None:
        for each in filter(self._is_overdue, unplaced):
            reason = self._unplaced(each.message.header.frame_id)
            self._drop(each, reason)
            text = f'dropped: {reason}; {self._beside_odometry(each.stamp_ns)}'
            self._node.get_logger().warning(text, throttle_duration_sec=5.0)

    def _read(self, each: _Waiting, odometry: Array, mount: Array) -> Cloud | None:
        """Return a waiting cloud, which waits no longer; None if it is dropped."""
        self._waiting.remove(each)
        others = [ns for topic, ns in self._used_ns.items() if topic != each.topic]
        if each.stamp_ns < max(others, default=0) - BEHIND_NS:
            self._count(BEHIND)
            return None
        try:
            points, age = points_in(each.message)
        except ValueError as error:
            self._count(MALFORMED)
            self._node.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return None
        last_ns = max(self._used_ns.values(), default=each.stamp_ns)
        silence = self._silence_between(last_ns, each.stamp_ns)
        self._used_ns[each.topic] = each.stamp_ns
        self._dropped_ns = None
        return Cloud(each.stamp_ns, points, odometry, mount, age, silence)

    def _drop(self, each: _Waiting, reason: str) -> None:
        self._waiting.remove(each)
        self._count(reason)

    def _count(self, reason: str) -> None:
        """Count a cloud that is dropped."""
        self.drops[reason] += 1
        now_ns = steady_ns()
        self._dropped_ns = (self._dropped_ns or (now_ns, now_ns))[0], now_ns

    @property
    def unused(self) -> float:
        """Time from the first to the last cloud that was dropped since one was used [s]."""
        first_ns, last_ns = self._dropped_ns or (0, 0)
        return (last_ns - first_ns) / NS_PER_S

    def _is_overdue(self, each: _Waiting) -> bool:
        """Return whether a cloud has waited for odometry for too long."""
        deadline = self._config.odometry_deadline + max(self._config.odometry_delay, 0.0)
        return steady_ns() - each.since_ns > deadline * NS_PER_S

    def _beside_odometry(self, stamp_ns: int) -> str:
        """Return in words how far a stamp is from odometry."""
        if self.newest_ns is None:
            return 'there was no odometry so far'
        later = (stamp_ns - self.newest_ns) / NS_PER_S
        return f'stamped {later:+.1f} s after the newest odometry'

    def _unplaced(self, frame: str) -> str:
        """Return why clouds in a frame have no pose."""
        base = self._config.base_frame
        if frame == base or self.odometry.buffer.can_transform(base, frame, Time()):
            return NO_ODOMETRY
        if len(self._unknown_frames) < MOST_FRAMES:
            self._unknown_frames.add(frame)
        name = f"'{frame}'" if frame in self._unknown_frames else 'others'
        return f"cloud in a frame without transform to '{base}': {name}"

    def _poses_of(self, message: PointCloud2) -> tuple[Array, Array] | None:
        """Return the poses of a cloud's frame, see Cloud; None as long as TF lacks one."""
        stamp_ns, frame = time_ns(message.header.stamp), message.header.frame_id
        odometry = self.odometry_of(frame, stamp_ns)
        mount = self._pose_in(self._config.base_frame, frame, stamp_ns)
        return None if odometry is None or mount is None else (odometry, mount)

    @property
    def newest_ns(self) -> int | None:
        """Instant of the newest odometry [ns]; None if there is none."""
        stamp_ns = self.odometry.newest_ns
        return None if stamp_ns is None else stamp_ns - self._delay_ns

    def odometry_of(self, frame: str, instant_ns: int) -> Array | None:
        """Return a frame's pose in that of odometry at an instant [ns]; None if TF lacks it.

        In a pause of odometry, TF would interpolate, however long that was.
        """
        stamp_ns = instant_ns + self._delay_ns
        if any(begin_ns < stamp_ns < end_ns for begin_ns, end_ns in self._pauses_ns):
            return None
        return self._pose_in(self._config.odom_frame, frame, stamp_ns)

    def _silence_between(self, begin_ns: int, end_ns: int) -> float:
        """Return for how long odometry was silent between two instants [ns], in s."""
        begin_ns, end_ns = begin_ns + self._delay_ns, end_ns + self._delay_ns
        parts_ns = (min(last, end_ns) - max(first, begin_ns) for first, last in self._pauses_ns)
        return sum(part_ns for part_ns in parts_ns if part_ns > 0) / NS_PER_S

    def _odometry_came(self, stamp_ns: int, *_: object) -> None:
        if pause := self._silence.seconds(stamp_ns):
            self._pauses_ns.append((stamp_ns - round(pause * NS_PER_S), stamp_ns))
        self._silence.heard(stamp_ns)

    def _forget_pauses(self) -> None:
        self._silence = Silence()  # of odometry, by its stamps
        self._pauses_ns: deque[tuple[int, int]] = deque(maxlen=MOST_PAUSES)

    def _pose_in(self, parent: str, frame: str, stamp_ns: int) -> Array | None:
        if stamp_ns < 0:
            return None
        at = Time(nanoseconds=stamp_ns, clock_type=ClockType.ROS_TIME)
        try:
            found = self.odometry.buffer.lookup_transform(parent, frame, at)
        except TransformException:
            return None
        return messages.matrix_of(found)

    def _arrived(
        self,
        topic: str,
        silence: Silence,
        publishers: Publishers,
        message: PointCloud2,
        info: dict[str, int],
    ) -> None:
        self.received += 1
        lost_before = publishers.lost
        publisher = publishers.add(info.get('publication_sequence_number'))
        self.drops += Counter({LOST: publishers.lost - lost_before})
        if publisher != self._sources.setdefault(topic, publisher):
            # One that began anew is alone, or the one before is silent.
            several = self._node.count_publishers(self._node.resolve_topic_name(topic)) > 1
            if several and not silence.seconds(steady_ns()):
                self.drops[OF_OTHERS] += 1
                return
            self._sources[topic] = publisher
        if not 0 < time_ns(message.header.stamp) <= LATEST_NS:
            self._count(MALFORMED)
            return
        silence.heard(steady_ns(), time_ns(message.header.stamp))
        if is_of_odometry(message.header.frame_id, self._config.odom_frame):
            self._count(OF_ODOMETRY)
            return
        self._waiting.append(_Waiting(topic, message, steady_ns()))
        self._on_news()

    def _time_went_back(self) -> None:
        self._waiting.clear()
        self._used_ns.clear()
        self._forget_pauses()
        self._on_time_back()


def is_of_odometry(frame: str, odom_frame: str) -> bool:
    """Return whether a frame is that of odometry, or one that the assembler fixed in it.

    The latter are named by nodlidar_assembler.clouds.origins.frame_of.
    """
    return re.fullmatch(re.escape(odom_frame) + r'((_-?\d+){3})?', frame) is not None
