"""The gaps in height between the beams of neighbouring azimuth steps.

In each revolution, neighbouring steps have one run of consecutive samples: one interval of height,
folded at the nod's reversals. Heights are as in Pattern: above the lower limit, in samples.
"""

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np


class BeamGaps:
    """The highest gap between the beams of samples 0 <= n < samples, for many windows of steps.

    A window is the steps first <= s <= last. Steps from N_L on belong to the next revolution, and
    a window with last < first is empty. The limits of the nod bound gaps as beams do.

    Parameters
    ----------
    pattern
        Directions of the samples.
    samples
        Number of samples.
    """

    def __init__(self, pattern: Pattern, samples: int) -> None:
        self.pattern = pattern
        self._sweep = pattern.samples_per_sweep
        self._cycle = pattern.cycle
        self._whole = int(pattern.phase)
        self._fraction = pattern.phase - self._whole
        self._end = samples
        self._revolution = pattern.steps_per_revolution

    @property
    def spacing(self) -> float:
        """The widest gap between consecutive samples, in samples of the nod."""
        return 1.0

    @property
    def runs(self) -> int:
        """Number of runs of a window, empty ones included.

        Windows that reach into the next revolution need a run that begins before sample 0.
        """
        return 1 - (-self._end // self._revolution)

    @property
    def work_between_runs(self) -> int:
        """Number of array elements that between_runs() processes for one window."""
        return self.runs

    @property
    def work_between_samples(self) -> int:
        """Number of array elements that between_samples() processes for one window."""
        return self.runs + 4 * self._cycle

    def between_runs(self, first: Integers, last: Integers) -> tuple[Array, Array]:
        """Return the highest gap between the runs of each window, and its lower end.

        If it exceeds the spacing it is also the highest gap between the samples, since those of
        one run are no further apart than the spacing.

        Parameters
        ----------
        first, last
            First and last step of each window, shape (w,).

        Returns
        -------
        gap, bottom
            Height of the gap and of its lower end [samples], shape (w,).
        """
        a, b = self._runs_of(first, last)
        leg_a, height_a = self._folded(a)
        leg_b, height_b = self._folded(b)
        low, high = np.minimum(height_a, height_b), np.maximum(height_a, height_b)
        reversals = leg_b - leg_a
        up = leg_a % 2 == 0
        high[(reversals > 1) | ((reversals == 1) & up)] = self._sweep
        low[(reversals > 1) | ((reversals == 1) & ~up)] = 0.0
        # An empty run is placed at the limit, where it changes no gap.
        low[b < a] = high[b < a] = self._sweep
        # There is a gap where r runs have begun and all r have ended. So beginnings and ends can
        # be sorted separately.
        low.sort(axis=1)
        high.sort(axis=1)
        return highest(append(low, self._sweep) - prepend(high, 0.0), prepend(high, 0.0))

    def between_samples(self, first: Integers, last: Integers) -> tuple[Array, Array]:
        """Return the highest gap between the samples of each window, and its lower end.

        As between_runs(), but marks each sample in the nod's cycle: slower, and exact for gaps
        below the spacing.
        """
        a, b = self._runs_of(first, last)
        place = (a + self._whole) % self._cycle
        after = place + np.clip(b + 1 - a, 0, self._cycle)
        hit = _covered(place, after, 2 * self._cycle)
        hit = hit[:, : self._cycle] | hit[:, self._cycle :]
        height = self._folded(np.arange(self._cycle) - self._whole)[1]
        order = np.argsort(height)
        reached = np.maximum.accumulate(np.where(hit[:, order], height[order], 0.0), axis=1)
        return highest(
            append(height[order], self._sweep) - prepend(reached, 0.0), prepend(reached, 0.0)
        )

    def _runs_of(self, first: Integers, last: Integers) -> tuple[Integers, Integers]:
        """Return the first and last sample of each window's runs, shape (w, runs)."""
        begin = np.arange(-1, self.runs - 1) * self._revolution
        a = np.maximum(begin + first[:, None], 0)
        b = np.minimum(begin + last[:, None], self._end - 1)
        return a, b

    def _folded(self, n: Integers) -> tuple[Integers, Array]:
        """Return the leg of the nod that contains samples, even if upward, and their height."""
        m = n + self._whole
        leg = m // self._sweep
        along = (m - leg * self._sweep) + self._fraction
        return leg, np.where(leg % 2 == 0, along, self._sweep - along)


class WholeBeamGaps(BeamGaps):
    """BeamGaps of a whole period of the pattern.

    Steps that are equal modulo the pattern's stride then have beams at the same heights. So only
    windows that differ in their beginning modulo the stride, or in their width up to the stride,
    differ.
    """

    def __init__(self, pattern: Pattern) -> None:
        super().__init__(pattern, pattern.period)

    @property
    def work_between_runs(self) -> int:
        """Number of array elements that between_runs() processes for one window on average."""
        return max(1, self.runs * self.pattern.stride // self._revolution)

    def between_runs(self, first: Integers, last: Integers) -> tuple[Array, Array]:
        """See BeamGaps."""
        first, last, which = self._differing(first, last)
        gap, bottom = super().between_runs(first, last)
        return gap[which], bottom[which]

    def between_samples(self, first: Integers, last: Integers) -> tuple[Array, Array]:
        """See BeamGaps."""
        first, last, which = self._differing(first, last)
        gap, bottom = super().between_samples(first, last)
        return gap[which], bottom[which]

    def _differing(self, first: Integers, last: Integers) -> tuple[Integers, Integers, Integers]:
        """Return the distinct windows, and the index of each window among them."""
        stride = self.pattern.stride
        width = np.clip(last - first + 1, 0, stride)
        found, which = np.unique(first % stride * (stride + 1) + width, return_inverse=True)
        begin, width = np.divmod(found, stride + 1)
        return begin, begin + width - 1, which


def _covered(begin: Integers, end: Integers, places: int) -> Mask:
    """Return which places each row of half-open intervals covers, shape (rows, places)."""
    row = np.arange(len(begin))[:, None] * (places + 1)
    size = len(begin) * (places + 1)
    change = np.bincount((begin + row).ravel(), minlength=size)
    change -= np.bincount((end + row).ravel(), minlength=size)
    covered: Mask = np.cumsum(change.reshape(-1, places + 1), axis=1)[:, :-1] > 0
    return covered


def highest(gap: Array, bottom: Array) -> tuple[Array, Array]:
    """Return the highest gap of each row (w, n), and its lower end, shape (w,) each."""
    at = np.argmax(gap, axis=1)[:, None]
    return (
        np.take_along_axis(gap, at, axis=1)[:, 0],
        np.take_along_axis(bottom, at, axis=1)[:, 0],
    )


def append(values: Array, last: float) -> Array:
    """Return rows (w, n) with a value appended to each, shape (w, n + 1)."""
    return np.concatenate([values, np.full((*values.shape[:-1], 1), last)], axis=-1)


def prepend(values: Array, first: float) -> Array:
    """Return rows (w, n) with a value prepended to each, shape (w, n + 1)."""
    return np.concatenate([np.full((*values.shape[:-1], 1), first), values], axis=-1)
