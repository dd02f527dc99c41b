"""The gaps in height between the beams of a nod with errors in its reversals."""

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_planner.holes.beam_gaps import (
    append,
    BeamGaps,
    highest,
    prepend,
)
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np

# In sweeps of fewer samples, which errors in the reversals cause, samples are too far apart for a
# run: each is a run of its own. With more such breaks for each run, all samples are processed.
SHORT, MOST_BREAKS = 32, 64


class LateBeamGaps(BeamGaps):
    """BeamGaps of a nod with errors in its reversals, and constant speed between them.

    Parameters
    ----------
    pattern
        The planned one.
    samples
        Number of samples.
    reversals
        Their instants [samples], ascending, from one at the lower limit before sample 0 to one
        past the last sample, shape (t,); see `timing_error.reversal_instants`.
    """

    def __init__(self, pattern: Pattern, samples: int, reversals: Array) -> None:
        super().__init__(pattern, samples)
        self._reversals = _distinct(reversals)
        around = np.searchsorted(self._reversals, [0, max(0, samples - 1)], side='right')
        ends = self._reversals[around[0] - 1 : around[1] + 1]
        sweeps, least = np.diff(ends), max(1.0, min(SHORT, self._sweep / 8))
        self._spacing = float(self._sweep / sweeps[sweeps >= least].min(initial=self._sweep))
        self._breaks = _samples_at(ends, sweeps < least, samples)
        if len(self._breaks) > MOST_BREAKS * super().runs:
            self._breaks, self._spacing = self._breaks[:0], float(self._sweep)

    @property
    def spacing(self) -> float:
        """The widest gap between consecutive samples of a run, in samples of the nod."""
        return self._spacing

    @property
    def runs(self) -> int:
        """Number of runs of a window, empty ones included."""
        return super().runs + len(self._breaks)

    @property
    def work_between_samples(self) -> int:
        """Largest number of array elements that between_samples() processes for one window."""
        return super().runs * self._revolution

    def between_samples(self, first: Integers, last: Integers) -> tuple[Array, Array]:
        """Return the highest gap between the samples of each window, and its lower end.

        As between_runs(), but sorts all samples, since such a nod has no cycle: for sweeps so
        short that the samples of a run are far apart.
        """
        a, b = super()._runs_of(first, last)
        n = a[:, :, None] + np.arange(max(1, int((b - a).max()) + 1))
        height = np.where(n <= b[:, :, None], self._folded(n)[1], self._sweep)
        height = np.sort(height.reshape(len(first), -1), axis=1)
        return highest(append(height, self._sweep) - prepend(height, 0.0), prepend(height, 0.0))

    def _runs_of(self, first: Integers, last: Integers) -> tuple[Integers, Integers]:
        """Return the runs, split where samples are too far apart for one run."""
        a, b = super()._runs_of(first, last)
        if not len(self._breaks):
            return a, b
        following = np.append(self._breaks, self._end)
        end = following[np.searchsorted(self._breaks, a, side='right')] - 1
        # Where the run of each break begins and ends, if the window has one.
        begins = self._breaks - (self._breaks - first[:, None]) % self._revolution
        ends = np.minimum(begins + (last - first)[:, None], following[1:] - 1)
        after = np.where(begins < self._breaks, self._breaks, self._end)
        return np.append(a, after, axis=1), np.append(np.minimum(b, end), ends, axis=1)

    def _folded(self, n: Integers) -> tuple[Integers, Array]:
        n = np.clip(n, 0, max(0, self._end - 1))  # other samples belong to no run
        leg = np.searchsorted(self._reversals, n, side='right') - 1
        begin, end = self._reversals[leg], self._reversals[leg + 1]
        part: Array = (n - begin) / (end - begin)
        height: Array = np.where(leg % 2 == 0, part, 1.0 - part)
        return leg, float(self._sweep) * height


def _distinct(reversals: Array) -> Array:
    """Return reversals without sweeps of no duration, but with jumps from limit to limit."""
    _, begins, count = np.unique(reversals, return_index=True, return_counts=True)
    kept = np.zeros(len(reversals), dtype=np.bool_)
    kept[begins] = True
    kept[begins[count % 2 == 0] + 1] = True
    return np.asarray(reversals[kept])


def _samples_at(reversals: Array, short: Mask, samples: int) -> Integers:
    """Return every sample of the short sweeps, and the first sample after each."""
    at = np.ceil(reversals).astype(np.int64)
    found = [np.arange(at[k], at[k + 1] + 1) for k in np.flatnonzero(short)]
    breaks: Integers = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))
    inside = (breaks > 0) & (breaks < samples)
    return np.asarray(breaks[inside])
