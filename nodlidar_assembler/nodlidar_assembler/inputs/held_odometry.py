"""Odometry that is sent more often than it is measured."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
import math
from statistics import median

from nodlidar_common.nod import NS_PER_S

CHANGES = 10  # of the pose, by which it is judged
MOVING_NS = NS_PER_S // 2  # from change to change; a robot that stands keeps its pose for longer
DISTANCE = 2.0  # of the points whose error is stated [m]
LEAST_ERROR = 0.01  # m; steps of wheel encoders at a crawl are smaller

Pose = tuple[Sequence[float], Sequence[float]]


@dataclass(frozen=True, slots=True)
class _Change:
    """A new pose: time since the last one [ns], samples in it, error of points until then [m]."""

    gap_ns: int
    samples: int
    error: float


class HeldOdometry:
    """Finds poses that are sent again with a newer stamp while the robot moves.

    Between two measurements the robot then seems to stand, and then to leap.
    """

    def __init__(self) -> None:
        self._changes: deque[_Change] = deque(maxlen=CHANGES)
        self._pose: Pose | None = None
        self._since_ns, self._samples = 0, 0

    def add(self, time_ns: int, position: Sequence[float], orientation: Sequence[float]) -> None:
        """Add a sample: time [ns], x y z [m], quaternion x y z w."""
        pose = position, orientation
        if pose != self._pose:
            if self._pose is not None:
                gap_ns, error = time_ns - self._since_ns, _error(self._pose, pose)
                self._changes.append(_Change(gap_ns, self._samples, error))
            self._pose, self._since_ns, self._samples = pose, time_ns, 0
        self._samples += 1

    @property
    def warning(self) -> str:
        """How far points are off by it; empty if they are not."""
        changes = self._changes
        if len(changes) < CHANGES or max(each.gap_ns for each in changes) > MOVING_NS:
            return ''
        samples = median(each.samples for each in changes)
        error = median(each.error for each in changes)
        if samples < 2.0 or error < LEAST_ERROR:
            return ''
        gap = median(each.gap_ns for each in changes) / 1e6
        return (
            f'odometry is stamped every {gap / samples:.0f} ms, but changes every {gap:.0f} ms: '
            f'points {DISTANCE:g} m away are up to {error * 1e3:.0f} mm off; '
            'stamp each pose once, with the time of its measurement'
        )


def _error(before: Pose, now: Pose) -> float:
    """Return how far a point at DISTANCE moves from one pose to another one, at most [m]."""
    alike = abs(sum(a * b for a, b in zip(before[1], now[1], strict=True)))
    return math.dist(before[0], now[0]) + DISTANCE * 2.0 * math.acos(min(alike, 1.0))
