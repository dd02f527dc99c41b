"""The poses of frames, from TF."""

from geometry_msgs.msg import TransformStamped
from nodlidar_common.pose import Pose
from nodlidar_common.ros.polled import PolledSubscription
from nodlidar_common.stamps import time_ns
from nodlidar_common.time_order import TIME_JUMP_NS
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException


class Transforms:
    """Listens to TF.

    Attributes
    ----------
    missing
        Why the last pose asked for is not known, in words; empty if it is.
    """

    def __init__(self, node: Node) -> None:
        self._buffer = Buffer()
        static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._moving = PolledSubscription(node, TFMessage, '/tf', QoSProfile(depth=100))
        self._static = PolledSubscription(node, TFMessage, '/tf_static', static)
        self._newest_ns: dict[str, int] = {}  # of each moving frame
        self.missing = ''

    def take(self) -> None:
        """Take what came since the last call."""
        for message in self._static.take():
            for transform in message.transforms:
                self._buffer.set_transform_static(transform, 'viewer')
        for message in self._moving.take():
            for transform in message.transforms:
                self._note_time(transform)
                self._buffer.set_transform(transform, 'viewer')

    def _note_time(self, transform: TransformStamped) -> None:
        """Forget the moving transforms if time went back: the buffer would ignore the new ones."""
        frame, stamp_ns = transform.child_frame_id, time_ns(transform.header.stamp)
        if self._newest_ns.get(frame, stamp_ns) - stamp_ns > TIME_JUMP_NS:
            self._buffer.clear()
            self._newest_ns.clear()
        self._newest_ns[frame] = max(stamp_ns, self._newest_ns.get(frame, stamp_ns))

    def pose(self, parent: str, frame: str, stamp_ns: int = 0) -> Pose | None:
        """Return the pose of a frame in another one, at an instant [ns] or by default the latest.

        None if it is not known.
        """
        if stamp_ns < 0:  # which rclpy refuses
            self.missing = f"'{frame}' is stamped {stamp_ns} ns, before time began"
            return None
        at = Time(nanoseconds=stamp_ns, clock_type=ClockType.ROS_TIME)
        try:
            found = self._buffer.lookup_transform(parent, frame, at).transform
        except TransformException as error:
            self.missing = str(error)
            return None
        self.missing = ''
        p, q = found.translation, found.rotation
        return Pose.from_quaternion((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))

    def end(self) -> None:
        """End the subscriptions."""
        self._moving.end()
        self._static.end()
