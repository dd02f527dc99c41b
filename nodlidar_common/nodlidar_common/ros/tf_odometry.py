"""Odometry from TF, with the samples' own times."""

from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from itertools import islice

from geometry_msgs.msg import TransformStamped
from nodlidar_common.publishers import Publishers
from nodlidar_common.ros.polled import taken, WhenWanted
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_common.steady_stamps import SteadyStamps
from nodlidar_common.survival import Survival
from nodlidar_common.time_order import (
    TIME_JUMP_NS,
    TimeOrder,
    TRANSFORM_OUT_OF_ORDER,
    UNSTAMPED,
)
from nodlidar_common.transforms import is_pose, MALFORMED, unit_quaternion
from rclpy.clock import ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException

WAITING = 1000  # messages of all nodes, until they are taken
# Messages that are taken at once. Where they are too many for the computer, more come as fast as
# they are taken; this many keep up with 3 kHz, if they are taken with each scan of a URG alone.
MOST_TAKEN = 300
_AUTHORITY = 'nodlidar'  # of what is set in the buffer


class TfOdometry:
    """Passes on the pose of a frame in the frame of odometry whenever TF has a later one.

    Messages on /tf wait until they are taken, and wake the node never: on a robot with many
    frames, most of them are of others.

    A buffer interpolates between two transforms, however far apart they are. To keep gaps and
    jumps visible, each pose is looked up at its own time.

    A single wrong message must not end the odometry, but a buffer keeps it for good. So these are
    dropped: a transform between the two frames whose stamp goes back by more than TIME_JUMP_NS, or
    leaps ahead; one without a stamp; one of a frame that was fixed first and moves now, or the
    other way round; and the last message of a loop of parents, after which all earlier ones are
    forgotten. So are they when time goes back for several transforms in a row, or for the clock of
    the node.

    Parameters
    ----------
    node
        Subscribes to /tf and /tf_static.
    odom_frame, frame
        Frame of odometry, and the frame to be located in it.
    on_sample
        Called with each new pose: [ns], x y z [m], x y z w.
    on_time_back
        Called when time went back.
    survival
        Catches errors of the callbacks.
    on_drop
        Called with the reason for each transform that is dropped, and for each loop.
    period
        Of transforms between the two frames whose stamps jitter [s]: they get steady ones, also in
        the buffer; 0 takes the stamps as they are.

    Attributes
    ----------
    buffer
        The transforms.
    newest_ns
        Time of the latest pose [ns]; None if there is none.
    ahead_ns
        By how much that was later than the host's time when the pose came [ns].
    missing_input
        Why there is none, in words; empty if there is one.
    """

    LOOP = 'transform that closes a loop of frames'
    BOTH = 'transform on /tf of a frame fixed by /tf_static, or the other way round'

    def __init__(
        self,
        node: Node,
        odom_frame: str,
        frame: str,
        on_sample: Callable[[int, Sequence[float], Sequence[float]], None],
        on_time_back: Callable[[], None],
        survival: Survival,
        on_drop: Callable[[str], None] = lambda reason: None,
        period: float = 0.0,
    ) -> None:
        self._node, self._survival, self._on_drop = node, survival, on_drop
        self.newest_ns: int | None = None
        self.ahead_ns = self._arrived_ns = 0
        self.missing_input = 'no transform was heard'
        self._odom_frame, self._frame = odom_frame, frame
        self._parents: dict[str, str] = {}
        self._fixed: set[str] = set()
        # Each moving frame has its own; only those between the two frames are kept in order.
        self._orders: defaultdict[str, TimeOrder[TransformStamped]] = defaultdict(
            lambda: TimeOrder(
                lambda: self._on_drop(TRANSFORM_OUT_OF_ORDER), longest_fall_ns=TIME_JUMP_NS
            )
        )
        period_ns = round(period * NS_PER_S)
        self._steady = defaultdict[str, SteadyStamps](lambda: SteadyStamps(period_ns))
        self._publishers: defaultdict[str, Publishers] = defaultdict(Publishers)
        self._on_sample, self._on_time_back = on_sample, on_time_back
        self.buffer = Buffer()
        # A simulated clock may jump back. Stamps may go back by less, and would seem to be late.
        backward = Duration(nanoseconds=-TIME_JUMP_NS)
        self._jump_handle = node.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=backward, on_clock_change=False),
            post_callback=lambda jump: self._clock_went_back(),
        )
        self._moving = node.create_subscription(
            TFMessage, '/tf', self.add, QoSProfile(depth=WAITING), callback_group=WhenWanted()
        )
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._static = node.create_subscription(TFMessage, '/tf_static', self.add_static, latched)

    def take(self) -> None:
        """Add the messages that wait, at most MOST_TAKEN."""
        for message, info in islice(taken(self._moving), MOST_TAKEN):
            self.add(message, info)

    def restart(self) -> None:
        """Forget the moving transforms and the newest pose: their times are of another clock."""
        self._forget()
        self.newest_ns = None

    def _clock_went_back(self) -> None:
        self.take()  # what waits is of the time before, or already of the new one
        new = [one for order in self._orders.values() for one in order.withdraw()]
        self._go_back()
        self._add_in_order(new, self._node.get_clock().now().nanoseconds)

    def _go_back(self) -> None:
        self.restart()
        self._on_time_back()

    def _forget(self) -> None:
        """Forget the moving transforms."""
        self.buffer.clear()
        for child, order in self._orders.items():
            self._parents.pop(child, None)
            order.restart()
        self._orders.clear()
        self._steady.clear()

    def unregister(self) -> None:
        """Stop listening."""
        self._node.destroy_subscription(self._moving)
        self._node.destroy_subscription(self._static)
        # Otherwise the node's clock keeps calling this and refuses the next one.
        self._jump_handle.unregister()

    @property
    def shared(self) -> dict[str, int]:
        """The transforms between the two frames that several nodes publish, and how many do."""
        between = self._above(self._frame) ^ self._above(self._odom_frame)
        return {
            f"the transform to '{frame}'": publishers.active
            for frame, publishers in self._publishers.items()
            if frame in between and publishers.active > 1
        }

    def add(self, data: TFMessage, info: dict[str, int]) -> None:
        """Add the transforms of a message."""
        with self._survival.surviving():
            number = info.get('publication_sequence_number')
            now_ns = self._node.get_clock().now().nanoseconds
            for frame in {transform.child_frame_id for transform in data.transforms}:
                publishers = self._publishers[frame]
                publishers.note(publishers.add(number), now_ns)
            self._arrived_ns = info.get('received_timestamp') or now_ns
            self._add_in_order(self._well_formed(data, self._fixed), now_ns)

    def _add_in_order(self, transforms: list[TransformStamped], now_ns: int) -> None:
        for transform in transforms:
            if not time_ns(transform.header.stamp):
                self._on_drop(UNSTAMPED)
                continue
            for one in self._in_order(transform, now_ns):
                self._add(one)

    def _well_formed(self, data: TFMessage, others: Collection[str]) -> list[TransformStamped]:
        """Drop malformed transforms, and those of frames of the other kind; return the others.

        Their quaternions are normalised, which the buffer leaves to others.
        """
        good = []
        for transform in data.transforms:
            if not is_pose(transform):
                self._on_drop(MALFORMED)
            elif transform.child_frame_id in others:
                self._on_drop(self.BOTH)
            else:
                q = transform.transform.rotation
                q.x, q.y, q.z, q.w = unit_quaternion(q)
                good.append(transform)
        return good

    def _in_order(self, transform: TransformStamped, now_ns: int) -> list[TransformStamped]:
        """Take a transform; return those that it confirms, and forget others if time went back."""
        order = self._orders[transform.child_frame_id]
        if not self._is_between(transform.child_frame_id):
            return [transform]
        newest_ns = order.newest_ns or 0
        confirmed = order.add(time_ns(transform.header.stamp), transform, now_ns)
        if confirmed and newest_ns - time_ns(confirmed[0].header.stamp) > TIME_JUMP_NS:
            self._go_back()
            # The next one has to follow these.
            return [one for first in confirmed for one in self._in_order(first, now_ns)]
        return confirmed

    def _is_between(self, child: str) -> bool:
        """Return whether a frame is on the way between the two frames, or may be."""
        one, other = self._above(self._frame), self._above(self._odom_frame)
        return one.isdisjoint(other) or child in one ^ other

    def _add(self, transform: TransformStamped) -> None:
        """Add a transform; pass on the pose at its time, if it may have changed."""
        self._note_parent(transform)
        one, other = self._above(self._frame), self._above(self._odom_frame)
        if transform.child_frame_id not in one | other and not one.isdisjoint(other):
            self.buffer.set_transform(transform, _AUTHORITY)
            return
        if self._loops():
            self.missing_input = self.LOOP
            self._on_drop(self.LOOP)
            self._forget()
            return
        if self._is_between(transform.child_frame_id):
            steady_ns = self._steady[transform.child_frame_id].of(time_ns(transform.header.stamp))
            transform.header.stamp = Time(nanoseconds=steady_ns).to_msg()
        self.buffer.set_transform(transform, _AUTHORITY)
        self._sample()

    def add_static(self, data: TFMessage) -> None:
        """Add the fixed transforms of a message."""
        self.take()  # what came before it
        with self._survival.surviving():
            for transform in self._well_formed(data, self._orders):
                self._fixed.add(transform.child_frame_id)
                self._note_parent(transform)
                self.buffer.set_transform_static(transform, _AUTHORITY)
            self._sample()

    def _note_parent(self, transform: TransformStamped) -> None:
        self._parents[transform.child_frame_id] = transform.header.frame_id

    def _loops(self) -> bool:
        """Return whether the way up from a frame comes back to it, or to one on the way."""
        ends = (self._frame, self._odom_frame)
        return any(self._above(end) <= self._parents.keys() for end in ends)

    def _above(self, frame: str) -> set[str]:
        """Return a frame and its ancestors."""
        found: set[str] = set()
        name: str | None = frame
        while name is not None and name not in found:
            found.add(name)
            name = self._parents.get(name)
        return found

    def _gap(self) -> str:
        """Return which transform is missing between the two frames; empty if none is."""
        frames = self._odom_frame, self._frame
        if not self._above(self._odom_frame).isdisjoint(self._above(self._frame)):
            return ''
        begin, end = (
            min(self._above(each) - self._parents.keys(), default=each) for each in frames
        )
        doctor = '`ros2 run nodlidar_bringup doctor` examines the frames'
        return f"no transform from '{begin}' to '{end}'; {doctor}"

    def _sample(self) -> None:
        """Pass on the latest pose if it is later than the last one."""
        try:
            latest = self.buffer.get_latest_common_time(self._odom_frame, self._frame)
            if not latest.nanoseconds:
                self.missing_input = f"'{self._frame}' is fixed in '{self._odom_frame}'"
            if latest.nanoseconds <= (self.newest_ns or 0):
                return
            at = Time(nanoseconds=latest.nanoseconds, clock_type=ClockType.ROS_TIME)
            pose = self.buffer.lookup_transform(self._odom_frame, self._frame, at).transform
        except TransformException as error:
            self.missing_input = self._gap() or str(error).strip()
            return
        p, q = pose.translation, pose.rotation
        self.newest_ns, self.missing_input = latest.nanoseconds, ''
        self.ahead_ns = self.newest_ns - self._arrived_ns
        self._on_sample(latest.nanoseconds, (p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
