"""Single positions of a joint that are not of its motion."""

from collections import deque
from collections.abc import Callable
from itertools import pairwise

from nodlidar_common.stamps import NS_PER_S

SLACK = 0.02  # rad, that positions may be off by noise and jitter
FASTER = 1.5  # times the fastest of the last steps
_ACCELERATION = 300.0  # rad/s^2, of a joint that begins to move
_SPEED = 6.0  # rad/s, that it then has at most
_KEPT = 16  # samples
_LEAST = 3  # samples, that show how fast the joint is


class JointStrays:
    """Refuses single samples that lead out and back, farther than the joint moves.

    A sample that is farther from the one before than the joint went lately is held back until the
    next one. If that comes back as far, the joint was never there: a message of another publisher,
    or an error of the encoder. Otherwise the joint began to move, or has jumped, and both are
    passed on.

    A joint may move by the sum of SLACK, the way at FASTER times the highest speed of the last
    samples, and what an acceleration adds: 0.06 rad at 100 Hz and 1.7 rad/s. As stamps jitter, at
    least the mean time between the last samples counts.

    Parameters
    ----------
    on_reject
        Called for each sample that is refused.
    """

    def __init__(self, on_reject: Callable[[], None]) -> None:
        self._on_reject = on_reject
        self.restart()

    def restart(self) -> None:
        """Forget all samples."""
        self._passed: deque[tuple[int, float]] = deque(maxlen=_KEPT)
        self._held: tuple[int, float] | None = None

    def add(self, sample: tuple[int, float]) -> list[tuple[int, float]]:
        """Add a sample [ns], [rad]; return those that are passed on."""
        newest = self._held or (self._passed[-1] if self._passed else sample)
        if sample[0] < newest[0]:  # time went back
            self.restart()
        held, self._held, passed = self._held, None, []
        if held is not None:
            if self._leap(self._passed[-1], held) * self._leap(held, sample) < 0.0:
                self._on_reject()
            else:
                passed.append(held)
                self._passed.append(held)
        if len(self._passed) >= _LEAST and self._leap(self._passed[-1], sample):
            self._held = sample
        else:
            passed.append(sample)
            self._passed.append(sample)
        return passed

    def _leap(self, one: tuple[int, float], other: tuple[int, float]) -> float:
        """Return the way between two samples; 0 if the joint may have moved so far."""
        way = other[1] - one[1]
        if abs(way) <= SLACK:
            return 0.0
        mean_ns = max((self._passed[-1][0] - self._passed[0][0]) / (len(self._passed) - 1), 1.0)
        fastest = max(
            abs(b[1] - a[1]) / max(b[0] - a[0], mean_ns) for a, b in pairwise(self._passed)
        )
        duration_ns = max(other[0] - one[0], mean_ns)
        most = SLACK + FASTER * fastest * duration_ns + gained(duration_ns / NS_PER_S)
        return way if abs(way) > most else 0.0


def gained(duration: float) -> float:
    """Return how much farther a joint comes in a time [s] that accelerates."""
    return min(_ACCELERATION * duration**2 / 2.0, _SPEED * duration)
