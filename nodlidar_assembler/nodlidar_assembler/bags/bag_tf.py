"""Odometry from the transforms of a bag, one by one."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_topics import STATIC
from nodlidar_assembler.bags.fixed_transforms import (
    carried,
    Fixed,
    fixed_pose,
    fixed_transforms,
    numbers,
)
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import TF
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_common.steady_stamps import SteadyStamps
from nodlidar_common.time_order import UNSTAMPED
from nodlidar_common.transforms import is_pose, MALFORMED, unit_quaternion
import numpy as np

# Parent and child.
Ends = tuple[str, str]
Sample = tuple[int, Sequence[float], Sequence[float]]

# A transform that changes by less [m], or as an element of its quaternion, is fixed.
_STILL = 1e-4


class BagTf:
    """Finds the transforms from the frame of odometry to the carrier of a frame.

    Parameters
    ----------
    odom_frame, frame
        Frame of odometry, and the frame to be located in it.
    static
        All TFMessages with fixed transforms.
    moving
        All others. They are searched until odometry is found: transforms that never change are
        also fixed, as in bags of ROS 1, which has no topic for fixed ones.
    period
        Of odometry whose stamps jitter [s]; 0 takes the stamps as they are.

    Attributes
    ----------
    carrier, mount
        Frame to which the frame is fixed, and the frame's pose in it.

    Raises
    ------
    BagError
        If a fixed transform is not a pose.
    """

    def __init__(
        self,
        odom_frame: str,
        frame: str,
        static: Iterable[Any],
        moving: Iterable[Any] = (),
        period: float = 0.0,
    ) -> None:
        fixed = fixed_transforms(static)
        carrier, _ = carried(frame, fixed)
        fixed |= _never_moving(moving, odom_frame, carrier)
        self.carrier, self.mount = carried(frame, fixed)
        self._wanted = odom_frame, self.carrier
        self._steady = SteadyStamps(round(period * NS_PER_S))
        self._seen: set[Ends] = set()

    @property
    def missing_input(self) -> str:
        """Why there is no odometry; empty if there is some."""
        if self._wanted in self._seen:
            return ''
        wanted, *seen = (f"'{a}' to '{b}'" for a, b in (self._wanted, *sorted(self._seen)))
        return f'no transform from {wanted}' + (f', but from {", ".join(seen)}' if seen else '')

    def samples(self, message: Any, drops: Counter[str]) -> Iterator[Sample]:
        """Yield the carrier's poses in a TFMessage: [ns], x y z [m], x y z w; count others."""
        for entry in message.transforms:
            ends = entry.header.frame_id, entry.child_frame_id
            self._seen.add(ends)
            if ends != self._wanted:
                continue
            stamp_ns = time_ns(entry.header.stamp)
            if is_pose(entry) and stamp_ns:
                p = entry.transform.translation
                instant_ns = self._steady.of(stamp_ns)
                yield instant_ns, (p.x, p.y, p.z), unit_quaternion(entry.transform.rotation)
            else:
                drops[MALFORMED if stamp_ns else UNSTAMPED] += 1


def tf_in(source: BagSource, topic: str, config: AssemblerConfig) -> BagTf:
    """Return the odometry of frame_id in a bag, by the topic of the moving transforms."""
    static, moving = (
        (recorded.message for recorded in source.messages({name: TF}))
        for name in (topic + STATIC, topic)
    )
    tf = BagTf(config.odom_frame, config.frame_id, static, moving, config.odometry_period)
    del source.unreadable[topic]  # they are counted when they are read again
    return tf


def _never_moving(messages: Iterable[Any], odom_frame: str, carrier: str) -> Fixed:
    """Return the transforms that never change; none if the carrier's odometry is found."""
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
