"""Whether a transform of TF can be used, of rclpy or a bag read without ROS, and how it turns."""

import math
from typing import Any

from nodlidar_common.stamps import LATEST_NS, time_ns

MALFORMED = 'transform that is no pose, not between two frames, or not of 1970 to 2038'
LENGTH_TOLERANCE = 5e-3
"""Of lengths of quaternions; tf2 ignores all others and only logs it."""


def is_pose(transform: Any) -> bool:
    """Return whether a TransformStamped has a valid time, two frames and a pose that tf2 takes."""
    frame, child = transform.header.frame_id, transform.child_frame_id
    p, q = transform.transform.translation, transform.transform.rotation
    placed = all(map(math.isfinite, (p.x, p.y, p.z)))
    turned = abs(_length(q) - 1.0) < LENGTH_TOLERANCE
    named = bool(frame and child) and frame != child
    return named and placed and turned and 0 <= time_ns(transform.header.stamp) <= LATEST_NS


def unit_quaternion(rotation: Any) -> tuple[float, float, float, float]:
    """Return the Quaternion x, y, z, w of a pose with the length 1, which rounding may change."""
    length = _length(rotation)
    return rotation.x / length, rotation.y / length, rotation.z / length, rotation.w / length


def _length(rotation: Any) -> float:
    return math.hypot(rotation.x, rotation.y, rotation.z, rotation.w)
