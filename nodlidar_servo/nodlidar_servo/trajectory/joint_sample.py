"""Measurements of a joint that ros2_control moves."""

from dataclasses import dataclass
import math

from nodlidar_common.nod import NS_PER_S

LEAST_TO_DIFFER = 3
"""So many wrong stamps in a row show that it is the clock that is wrong."""


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


class JointStamps:
    """Refuses joint states without a stamp, or that are stamped long before or after they arrive.

    Parameters
    ----------
    longest
        Longest time between stamp and arrival [s].

    Attributes
    ----------
    refused
        How many were refused.
    trouble
        What is wrong with the stamps, after LEAST_TO_DIFFER in a row; empty if they are good.
    """

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._in_a_row = 0
        self._words: dict[bool, str] = {}  # since the last good stamp, by whether there is a stamp
        self.refused, self.trouble = 0, ''

    def restart(self) -> None:
        """Judge anew: clocks may agree again. Until they do, the words stay the same."""
        self._in_a_row, self.trouble = 0, ''

    def believe(self, stamp_ns: int, now_ns: int) -> bool:
        """Return whether a stamp [ns] is believed, at a time [ns]."""
        late = (now_ns - stamp_ns) / NS_PER_S
        if stamp_ns and abs(late) <= self._longest:
            self._in_a_row, self.trouble = 0, ''
            self._words.clear()
            return True
        self.refused += 1
        self._in_a_row += 1
        if self._in_a_row >= LEAST_TO_DIFFER:
            words = (
                f'are stamped {late:.3f} s before they arrive: the clocks of this node and of the '
                'controller manager differ; synchronise them, or set use_sim_time alike'
                if stamp_ns
                else 'have no stamp: their publisher must say when the joint was measured'
            )
            self.trouble = self._words.setdefault(bool(stamp_ns), words)
        return False
