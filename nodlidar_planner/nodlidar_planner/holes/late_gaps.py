"""The gaps in height between the beams of a nod whose turns are off."""

from nodlidar_planner.holes.beam_gaps import (
    append,
    BeamGaps,
    Floats,
    highest,
    Integers,
    prepend,
)
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np
from numpy.typing import NDArray

# Sweeps of fewer samples, of which a nod whose turns are off has some, are no run: these are too
# far apart. With so many breaks by them for each run, all samples are gone through instead.
SHORT, MOST_BREAKS = 32, 64


class LateBeamGaps(BeamGaps):
    """As BeamGaps, for a nod whose turns are off, with constant speed between them.

    Parameters
    ----------
    pattern
        As it should be.
    samples
        How many there are.
    turns
        Instants of the turns, in samples, ascending, from one at the lower limit before sample 0
        to one past the last sample, shape (t,); see `timing_error.turn_instants`.
    """

    def __init__(self, pattern: Pattern, samples: int, turns: Floats) -> None:
        super().__init__(pattern, samples)
        self._turns = _distinct(turns)
        around = np.searchsorted(self._turns, [0, max(0, samples - 1)], side='right')
        ends = self._turns[around[0] - 1 : around[1] + 1]
        sweeps, least = np.diff(ends), max(1.0, min(SHORT, self._turn / 8))
        self._spacing = float(self._turn / sweeps[sweeps >= least].min(initial=self._turn))
        self._breaks = _samples_at(ends, sweeps < least, samples)
        if len(self._breaks) > MOST_BREAKS * super().runs:
            self._breaks, self._spacing = self._breaks[:0], float(self._turn)

    @property
    def spacing(self) -> float:
        """The widest gap between consecutive samples of a run, in samples of the nod."""
        return self._spacing

    @property
    def runs(self) -> int:
        """How many runs of samples a window has, empty ones counted."""
        return super().runs + len(self._breaks)

    @property
    def work_between_samples(self) -> int:
        """How many array elements between_samples() goes through for one window at most."""
        return super().runs * self._revolution

    def between_samples(self, first: Integers, last: Integers) -> tuple[Floats, Floats]:
        """Return the highest gap between the samples of each window, and where it begins.

        As between_runs(), but going through the samples, since such a nod has no cycle: where a
        sweep is so short that samples are far apart within a run.
        """
        a, b = super()._runs_of(first, last)
        n = a[:, :, None] + np.arange(max(1, int((b - a).max()) + 1))
        height = np.where(n <= b[:, :, None], self._folded(n)[1], self._turn)
        height = np.sort(height.reshape(len(first), -1), axis=1)
        return highest(append(height, self._turn) - prepend(height, 0.0), prepend(height, 0.0))

    def _runs_of(self, first: Integers, last: Integers) -> tuple[Integers, Integers]:
        """Return the runs, which break where samples are too far apart to be of one."""
        a, b = super()._runs_of(first, last)
        if not len(self._breaks):
            return a, b
        following = np.append(self._breaks, self._end)
        end = following[np.searchsorted(self._breaks, a, side='right')] - 1
        # Where the run of each break begins and ends; without a run it has none.
        begins = self._breaks - (self._breaks - first[:, None]) % self._revolution
        ends = np.minimum(begins + (last - first)[:, None], following[1:] - 1)
        after = np.where(begins < self._breaks, self._breaks, self._end)
        return np.append(a, after, axis=1), np.append(np.minimum(b, end), ends, axis=1)

    def _folded(self, n: Integers) -> tuple[Integers, Floats]:
        n = np.clip(n, 0, max(0, self._end - 1))  # what is outside belongs to no run
        leg = np.searchsorted(self._turns, n, side='right') - 1
        part: Floats = (n - self._turns[leg]) / (self._turns[leg + 1] - self._turns[leg])
        height: Floats = np.where(leg % 2 == 0, part, 1.0 - part)
        return leg, float(self._turn) * height


def _distinct(turns: Floats) -> Floats:
    """Return turns without sweeps that take no time, but for jumps from limit to limit."""
    _, begins, count = np.unique(turns, return_index=True, return_counts=True)
    kept = np.zeros(len(turns), dtype=np.bool_)
    kept[begins] = True
    kept[begins[count % 2 == 0] + 1] = True
    return np.asarray(turns[kept])


def _samples_at(turns: Floats, short: NDArray[np.bool_], samples: int) -> Integers:
    """Return every sample of the sweeps that are short, and the first after each."""
    at = np.ceil(turns).astype(np.int64)
    found = [np.arange(at[k], at[k + 1] + 1) for k in np.flatnonzero(short)]
    breaks: Integers = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))
    inside = (breaks > 0) & (breaks < samples)
    return np.asarray(breaks[inside])
