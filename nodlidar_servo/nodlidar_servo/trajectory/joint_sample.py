"""Measurements of a joint that ros2_control moves."""

from dataclasses import dataclass
import math

from nodlidar_common.nod import NS_PER_S


@dataclass(frozen=True, slots=True)
class JointSample:
    """Pitch [rad] and velocity [rad/s] of the joint at a time [ns]."""

    stamp_ns: int
    pitch: float
    velocity: float


def joint_sample(
    stamp_ns: int, pitch: float, velocity: float, before: JointSample | None
) -> JointSample | None:
    """Return a measurement; None if it has no pitch, or is not later than the one before.

    A velocity that is missing, NaN, is that since the measurement before, or 0 without one.
    """
    if not math.isfinite(pitch) or (before is not None and stamp_ns <= before.stamp_ns):
        return None
    if not math.isfinite(velocity):  # not every hardware measures it
        velocity = 0.0
        if before is not None:
            velocity = (pitch - before.pitch) / (stamp_ns - before.stamp_ns) * NS_PER_S
    return JointSample(stamp_ns, pitch, velocity)
