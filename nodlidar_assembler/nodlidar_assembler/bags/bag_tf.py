"""Odometry from the transforms of a bag, as they come."""

from collections.abc import Callable, Iterable
from typing import Any

from nodlidar_assembler.bags.transforms import (
    carried,
    Fixed,
    fixed_pose,
    fixed_transforms,
    numbers,
)
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.turns import TIME_JUMP_NS
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import time_ns
import numpy as np

# Parent and child.
Ends = tuple[str, str]

# A transform that changes by less [m], or as an element of its quaternion, is fixed.
_STILL = 1e-4


class MountedHistory(OdometryHistory):
    """The odometry of what is fixed to the frame whose samples are added.

    Parameters
    ----------
    mount
        Its pose in that frame.
    """

    def __init__(self, mount: Pose) -> None:
        super().__init__()
        self._mount = mount

    def around(self, begin_ns: int, end_ns: int) -> Odometry:
        """Return the samples that bracket an interval [ns] most closely."""
        return super().around(begin_ns, end_ns).mounted(self._mount)


class BagTf:
    """Notes the transforms from the frame of odometry to what a frame is fixed to.

    As the node does, it forgets all when their time goes back by more than TIME_JUMP_NS.

    Parameters
    ----------
    odom_frame, frame
        Frame of odometry, and the frame whose pose in it is wanted.
    static
        All TFMessages with fixed transforms.
    moving
        All others. They are looked through unless odometry soon turns up in them: those that never
        change are fixed, too, as in bags of ROS 1, which has no topic for fixed ones.

    Attributes
    ----------
    history
        The frame's odometry.
    carrier
        What the frame is fixed to.

    Raises
    ------
    BagError
        If a fixed transform is no pose.
    """

    def __init__(
        self,
        odom_frame: str,
        frame: str,
        static: Iterable[Any],
        moving: Iterable[Any] = (),
    ) -> None:
        fixed = fixed_transforms(static)
        carrier, _ = carried(frame, fixed)
        fixed |= _never_moving(moving, odom_frame, carrier)
        self.carrier, mount = carried(frame, fixed)
        self.history = MountedHistory(mount)
        self._wanted = odom_frame, self.carrier
        self._seen: set[Ends] = set()
        self._on_sample: Callable[[], None] = lambda: None
        self._on_time_back: Callable[[], None] = lambda: None

    @property
    def trouble(self) -> str:
        """Why there is no odometry, in words; empty if there is."""
        if self._wanted in self._seen:
            return ''
        wanted, *seen = (f"'{a}' to '{b}'" for a, b in (self._wanted, *sorted(self._seen)))
        return f'no transform from {wanted}' + (f', but from {", ".join(seen)}' if seen else '')

    def register(self, on_sample: Callable[[], None], on_time_back: Callable[[], None]) -> None:
        """Set what is called after each new sample, and when time went back."""
        self._on_sample, self._on_time_back = on_sample, on_time_back

    def add(self, message: Any) -> None:
        """Take the transforms of a TFMessage."""
        for entry in message.transforms:
            ends = entry.header.frame_id, entry.child_frame_id
            self._seen.add(ends)
            if ends == self._wanted:
                self._add(time_ns(entry.header.stamp), entry.transform)

    def _add(self, stamp_ns: int, transform: Any) -> None:
        if (self.history.newest_ns or 0) - stamp_ns > TIME_JUMP_NS:
            self.history.clear()
            self._on_time_back()
        p, q = transform.translation, transform.rotation
        self.history.add(stamp_ns, (p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
        self._on_sample()


def _never_moving(messages: Iterable[Any], odom_frame: str, carrier: str) -> Fixed:
    """Return the transforms that never change; none if the carrier's odometry turns up."""
    first: dict[Ends, Any] = {}
    moved: set[Ends] = set()
    for message in messages:
        for entry in message.transforms:
            ends = entry.header.frame_id, entry.child_frame_id
            if ends == (odom_frame, carrier):
                return {}
            now = numbers(entry.transform)
            if np.abs(now - numbers(first.setdefault(ends, entry.transform))).max() > _STILL:
                moved.add(ends)
    return {
        child: (parent, fixed_pose(first[parent, child]))
        for parent, child in sorted(first.keys() - moved)
        if parent != odom_frame
    }
