"""A model of how a servo moves from limit to limit, learned from the measured beams."""

import math

from nodlidar_common.arrays import Array, Integers
import numpy as np

# Parts of half a sweep, and beams that the mean of each part extends over.
PARTS, MEMORY = 24, 2000
# A servo that is late or early by more than this part of a sweep is not on the nod.
LOCKED = 0.2


class Lateness:
    """How late a servo is between the limits, compared with a steady sweep, as measured.

    Acceleration and braking take a time that does not depend on the sweep's duration. So lateness
    is a function of the time since the reversal in the first half of a sweep, and of the time to
    the next reversal in the second half.

    Parameters
    ----------
    longest
        Duration of the longest sweep [samples].
    spread
        Standard deviation of the lateness before any measurement [samples].
    """

    def __init__(self, longest: float, spread: float) -> None:
        # Times from a reversal to the middle of the longest sweep.
        self._grid: Array = longest / 2.0 * np.arange(PARTS + 1, dtype=np.float64) / PARTS
        self._weight: Array = np.ones((2, PARTS + 1))
        self._late: Array = np.zeros((2, PARTS + 1))
        self._variance = np.full((2, PARTS + 1), spread**2)

    def add(self, since: Array, duration: Array, progress: Array) -> None:
        """Add measurements of beams.

        Parameters
        ----------
        since, duration
            Samples since the reversal, and from that reversal to the next; shape (n,).
        progress
            Part of the way between the limits that the servo has covered, shape (n,).
        """
        late = since - progress * duration
        if np.abs(late).max() > LOCKED * duration.max():
            return  # not on the nod yet
        first = since < duration / 2.0
        nearest = np.where(first, since, duration - since)
        at = np.minimum(np.rint(nearest / self._grid[1]).astype(np.int64), PARTS)
        at = np.where(first, at, PARTS + 1 + at)
        count, total = _sums(at, None), _sums(at, late)
        before = late - self._late.ravel()[at]
        self._weight = np.maximum(np.minimum(self._weight + count, MEMORY), count)
        self._late += (total - count * self._late) / self._weight
        spread = _sums(at, before * (late - self._late.ravel()[at]))
        self._variance += (spread - count * self._variance) / self._weight

    def progress(self, since: Array, duration: Array | float) -> Array:
        """Return the part of the way that the servo has covered; parameters as of `add`.

        Below 0 and above 1 it is beyond a limit, as after a late reversal.
        """
        early = np.interp(since, self._grid, self._late[0])
        late = np.interp(duration - since, self._grid, self._late[1])
        lateness = np.where(since < duration / 2.0, early, late)
        return np.asarray((since - lateness) / duration)

    @property
    def spread(self) -> float:
        """Standard deviation of the lateness over a sweep [samples]."""
        return math.sqrt(float(np.average(self._variance, weights=self._weight)))


def _sums(at: Integers, values: Array | None) -> Array:
    """Return the sum of the values at each place, shape (2, n); without values, their number."""
    return np.bincount(at, values, minlength=2 * (PARTS + 1)).reshape(2, -1).astype(np.float64)
