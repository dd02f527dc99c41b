"""The poses of frames, from TF."""

from nodlidar_common.pose import Pose
from nodlidar_common.ros.polled import PolledSubscription
import numpy as np
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from scipy.spatial.transform import Rotation
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
        self._buffer = Buffer(node=node)
        static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._moving = PolledSubscription(node, TFMessage, '/tf', QoSProfile(depth=100))
        self._static = PolledSubscription(node, TFMessage, '/tf_static', static)
        self.missing = ''

    def take(self) -> None:
        """Take what came since the last call."""
        for message in self._static.take():
            for transform in message.transforms:
                self._buffer.set_transform_static(transform, 'viewer')
        for message in self._moving.take():
            for transform in message.transforms:
                self._buffer.set_transform(transform, 'viewer')

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
        rotation = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
        return Pose(np.array([p.x, p.y, p.z]), rotation)

    def end(self) -> None:
        """End the subscriptions."""
        self._moving.end()
        self._static.end()
