"""The transforms in a bag: chains of fixed ones, and the numbers of each."""

from collections.abc import Iterable
import math
from typing import Any

from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_common.arrays import Array
from nodlidar_common.pose import Pose
from nodlidar_common.transforms import LENGTH_TOLERANCE
import numpy as np

# Parent, and pose in it, of each frame that does not move in its parent.
Fixed = dict[str, tuple[str, Pose]]


def fixed_transforms(messages: Iterable[Any]) -> Fixed:
    """Return those of TFMessages; raises BagError if one is not a pose."""
    return {
        entry.child_frame_id: (entry.header.frame_id, fixed_pose(entry.transform))
        for message in messages
        for entry in message.transforms
    }


def carried(frame: str, fixed: Fixed) -> tuple[str, Pose]:
    """Return the carrier of a frame, over any number of fixed ones, and the frame's pose in it."""
    mount, carrier, left = Pose.from_xyzrpy((0.0,) * 6), frame, dict(fixed)
    while carrier in left:
        parent, pose = left.pop(carrier)
        mount, carrier = pose @ mount, parent
    return carrier, mount


def fixed_pose(transform: Any) -> Pose:
    """Return a Transform message's pose; raises BagError if it is not a pose."""
    position, orientation = np.split(numbers(transform), [3])
    length = math.hypot(*orientation)
    if not abs(length - 1.0) < LENGTH_TOLERANCE:
        raise BagError(f'a fixed transform has a quaternion of the length {length}')
    if not np.isfinite(position).all():
        raise BagError(f'a fixed transform has the position {position}')
    return Pose.from_quaternion(position, orientation)


def numbers(transform: Any) -> Array:
    """Return a Transform message's x y z [m] and quaternion x y z w, shape (7,)."""
    p, q = transform.translation, transform.rotation
    return np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
