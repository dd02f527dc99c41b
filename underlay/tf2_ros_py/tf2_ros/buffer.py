"""The buffer: a tree of frames, filled and queried with messages."""

import threading

from geometry_msgs.msg import TransformStamped
from rclpy.logging import get_logger
from rclpy.time import Time
from tf2_ros._core import FrameTree
from tf2_ros._links import Link
from tf2_ros._rigid import Rigid
from tf2_ros.exceptions import InvalidArgumentException, TransformException
from underlay_refusal import Partial, refuse_arguments

_SPAN_NS = 10_000_000_000


class Buffer(Partial):
    """Keeps the transforms of the last 10 s and looks up any between them.

    Times are ``rclpy.time.Time`` or messages; 0 asks for the latest that the frames have in
    common.
    """

    def __init__(self, **uncovered):
        refuse_arguments('Buffer', uncovered)
        self._tree = FrameTree(_SPAN_NS)
        self._lock = threading.Lock()

    def clear(self):
        """Forget all transforms but the static ones."""
        with self._lock:
            self._tree.clear()

    def set_transform(self, transform, authority):
        """Add a transform; one that is invalid or too old is ignored with a log message."""
        self._set(transform, authority, is_static=False)

    def set_transform_static(self, transform, authority):
        """Add a transform that holds at all times."""
        self._set(transform, authority, is_static=True)

    def lookup_transform(self, target_frame, source_frame, time):
        """Return the transform from source to target frame; raises TransformException."""
        with self._lock:
            found = self._tree.lookup(target_frame, source_frame, _nanoseconds(time))
        return _message(target_frame, source_frame, *found)

    def can_transform(self, target_frame, source_frame, time):
        """Return whether a lookup succeeds now."""
        try:
            self.lookup_transform(target_frame, source_frame, time)
        except TransformException:
            return False
        return True

    def get_latest_common_time(self, target_frame, source_frame):
        """Return the latest time of the two frames' transform; raises TransformException."""
        with self._lock:
            self._tree.check_name(target_frame, 'target_frame')
            self._tree.check_name(source_frame, 'source_frame')
            return Time(nanoseconds=self._tree.latest_common_ns(target_frame, source_frame))

    def _set(self, message, authority, is_static):
        t, r = message.transform.translation, message.transform.rotation
        pose = Rigid((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))
        frame, time_ns = message.child_frame_id, _nanoseconds(message.header.stamp)
        with self._lock:
            try:
                link = Link(message.header.frame_id, pose)
                young = self._tree.set(frame, time_ns, link, is_static)
            except InvalidArgumentException as error:
                get_logger('tf2').error(
                    f'Ignoring transform from authority "{authority}": {error}'
                )
                return
        if not young:
            get_logger('tf2').warning(
                f'TF_OLD_DATA ignoring data from the past for frame {frame} at time '
                f'{time_ns * 1e-9:.6f} according to authority {authority}'
            )


def _nanoseconds(time):
    """Return a time of rclpy or of a message in nanoseconds."""
    if hasattr(time, 'nanosec'):
        return time.sec * 1_000_000_000 + time.nanosec
    return time.nanoseconds


def _message(target_frame, source_frame, time_ns, pose):
    message = TransformStamped(child_frame_id=source_frame)
    message.header.frame_id = target_frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = pose.translation
    rotation.x, rotation.y, rotation.z, rotation.w = pose.rotation
    return message
