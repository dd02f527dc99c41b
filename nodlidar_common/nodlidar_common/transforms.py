"""Whether a transform of TF can be used: messages of rclpy, or of a bag read without ROS."""

import math
from typing import Any

from nodlidar_common.stamps import LATEST_NS, time_ns

MALFORMED = 'transform that is no pose, not between two frames, or not of 1970 to 2038'
_TF2_TOLERANCE = 5e-3  # of lengths of quaternions; tf2 ignores all others and only logs it


def is_pose(transform: Any) -> bool:
    """Return whether a TransformStamped has a valid time, two frames and a pose that tf2 takes."""
    frame, child = transform.header.frame_id, transform.child_frame_id
    p, q = transform.transform.translation, transform.transform.rotation
    placed = all(map(math.isfinite, (p.x, p.y, p.z)))
    turned = abs(math.hypot(q.x, q.y, q.z, q.w) - 1.0) < _TF2_TOLERANCE
    named = bool(frame and child) and frame != child
    return named and placed and turned and 0 <= time_ns(transform.header.stamp) <= LATEST_NS
