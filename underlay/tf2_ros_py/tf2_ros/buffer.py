"""The buffer: a tree of frames that is filled and asked with messages."""

import threading

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, JumpThreshold
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.task import Future
from rclpy.time import Time
from tf2_ros._core import FrameTree, Link
from tf2_ros._rigid import compose, normalized, Rigid
from tf2_ros.exceptions import InvalidArgumentException, TransformException
from underlay_refusal import Partial

_NO_WAIT = Duration()


class Buffer(Partial):
    """Remembers the transforms of the last `cache_time` (10 s) and looks up any between them.

    Times are ``rclpy.time.Time`` or messages; 0 asks for the latest that the frames have in
    common. The clock of `node` is watched for jumps back, which clear the buffer.
    """

    def __init__(self, cache_time=None, node=None):
        cache_time = Duration(seconds=10) if cache_time is None else cache_time
        self._tree = FrameTree(_nanoseconds(cache_time))
        self._changed = threading.Condition()
        self._waiting = []
        self.clock = Clock() if node is None else node.get_clock()
        threshold = JumpThreshold(
            min_forward=None, min_backward=Duration(seconds=-1), on_clock_change=True
        )
        self.jump_handle = self.clock.create_jump_callback(
            threshold, post_callback=self.time_jump_callback
        )

    def time_jump_callback(self, time_jump):
        """Clear the buffer since time went back."""
        get_logger('tf2_buffer').warning('Detected jump back in time. Clearing tf buffer.')
        self.clear()

    def clear(self):
        """Forget all transforms but the static ones."""
        with self._changed:
            self._tree.clear()

    def set_transform(self, transform, authority):
        """Add a transform; one that is invalid or too old is ignored with a log message."""
        self._set(transform, authority, is_static=False)

    def set_transform_static(self, transform, authority):
        """Add a transform that holds at all times."""
        self._set(transform, authority, is_static=True)

    def lookup_transform(self, target_frame, source_frame, time, timeout=_NO_WAIT):
        """Return the transform from source to target frame, waiting for it up to a timeout."""
        self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def lookup_transform_full(
        self,
        target_frame,
        target_time,
        source_frame,
        source_time,
        fixed_frame,
        timeout=_NO_WAIT,
    ):
        """Return the transform from source frame then to target frame at another time.

        In between, `fixed_frame` is taken as standing still.
        """
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        self.can_transform_full(*asked, timeout)
        return self.lookup_transform_full_core(*asked)

    def can_transform(
        self,
        target_frame,
        source_frame,
        time,
        timeout=_NO_WAIT,
        return_debug_tuple=False,
    ):
        """Tell whether a lookup would do, within a timeout; the tuple says also why not."""
        result = self._await(
            lambda: self.can_transform_core(target_frame, source_frame, time), timeout
        )
        return result if return_debug_tuple else result[0]

    def can_transform_full(
        self,
        target_frame,
        target_time,
        source_frame,
        source_time,
        fixed_frame,
        timeout=_NO_WAIT,
        return_debug_tuple=False,
    ):
        """Tell whether a full lookup would do, within a timeout; the tuple says also why not."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        result = self._await(lambda: self.can_transform_full_core(*asked), timeout)
        return result if return_debug_tuple else result[0]

    def wait_for_transform_async(self, target_frame, source_frame, time):
        """Return a future whose result is the transform, once there is one."""
        return self._promise(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def wait_for_transform_full_async(
        self, target_frame, target_time, source_frame, source_time, fixed_frame
    ):
        """Return a future whose result is the full lookup's, once there is one."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        return self._promise(lambda: self.lookup_transform_full_core(*asked))

    async def lookup_transform_async(self, target_frame, source_frame, time):
        """Return the transform once there is one."""
        return await self.wait_for_transform_async(target_frame, source_frame, time)

    async def lookup_transform_full_async(
        self, target_frame, target_time, source_frame, source_time, fixed_frame
    ):
        """Return the full lookup's transform once there is one."""
        return await self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame
        )

    def get_latest_common_time(self, target_frame, source_frame):
        """Return the latest time at which the two frames' transform is known."""
        with self._changed:
            self._tree.check_name(target_frame, 'target_frame')
            self._tree.check_name(source_frame, 'source_frame')
            try:
                return Time(nanoseconds=self._tree.latest_common_ns(target_frame, source_frame))
            except TransformException as error:
                raise TransformException(str(error)) from None  # as Jazzy has it

    def lookup_transform_core(self, target_frame, source_frame, time):
        """Return the transform from source to target frame; never waits."""
        with self._changed:
            found = self._tree.lookup(target_frame, source_frame, _nanoseconds(time))
        return _message(target_frame, source_frame, *found)

    def lookup_transform_full_core(
        self, target_frame, target_time, source_frame, source_time, fixed_frame
    ):
        """Return the full lookup's transform; never waits."""
        with self._changed:
            self._tree.check_name(target_frame, 'target_frame')
            self._tree.check_name(source_frame, 'source_frame')
            self._tree.check_name(fixed_frame, 'fixed_frame')
            _, first = self._tree.lookup(fixed_frame, source_frame, _nanoseconds(source_time))
            time_ns, then = self._tree.lookup(target_frame, fixed_frame, _nanoseconds(target_time))
        pose = compose(then, first)
        pose = Rigid(pose.translation, normalized(pose.rotation))
        return _message(target_frame, source_frame, time_ns, pose)

    def can_transform_core(self, target_frame, source_frame, time):
        """Return whether a lookup would do, and why not; never waits."""
        return _can(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def can_transform_full_core(
        self, target_frame, target_time, source_frame, source_time, fixed_frame
    ):
        """Return whether a full lookup would do, and why not; never waits."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        return _can(lambda: self.lookup_transform_full_core(*asked))

    def _set(self, message, authority, is_static):
        t, r = message.transform.translation, message.transform.rotation
        pose = Rigid((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))
        frame, time_ns = message.child_frame_id, _nanoseconds(message.header.stamp)
        with self._changed:
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
                return
            self._changed.notify_all()
            waiting = list(self._waiting)
        for fulfil in waiting:
            fulfil()

    def _await(self, attempt, timeout):
        """Try until it works or the timeout is over; return the last result."""
        with self._changed:
            self._changed.wait_for(lambda: attempt()[0], timeout.nanoseconds * 1e-9)
            return attempt()

    def _promise(self, lookup):
        future = Future()

        def fulfil():
            try:
                result = lookup()
            except TransformException:
                return
            with self._changed:
                if fulfil not in self._waiting:
                    return
                self._waiting.remove(fulfil)
            if not future.cancelled():
                future.set_result(result)

        self._waiting.append(fulfil)
        fulfil()
        return future


def _can(lookup):
    try:
        lookup()
    except TransformException as error:
        return False, str(error)
    return True, ''


def _nanoseconds(time):
    """Return a time or duration, of rclpy or a message, in nanoseconds."""
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
