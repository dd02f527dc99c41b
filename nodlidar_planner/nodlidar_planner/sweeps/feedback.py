"""The next sweep, chosen for the cells not seen yet, given the true directions of past beams.

No servo reverses with the timing of a single beam, so the planned pattern never happens exactly.
But the true directions of past beams are known, and so is the timing error of the next reversal.
The duration of the next sweep is chosen, near the planned one, for the unseen cells that this
sweep and the next will hit.
"""

import math

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_planner.pattern.task import column_runs, ON_THE_LINE, Task
from nodlidar_planner.sweeps.lateness import Lateness
from nodlidar_planner.sweeps.schedule import rows_of
import numpy as np

# Durations to choose from: their largest deviation from the planned one, and their number.
SPREAD = 0.15
CANDIDATES = 61
# The best durations, this many, each this many candidates or more from the others, are examined
# with the sweep after.
EXAMINED, APART = 4, 5
# Most heights that are distinguished in a row, and the fewest samples between them: a servo is
# less accurate.
FINE, CLOSEST = 8, 12
# Worth, for the sweep after, of a cell that the next sweep should hit.
DOUBT = 0.15


class Feedback:
    """The unseen cells, and the choice of the next sweep.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples_per_sweep
        The planned duration of a sweep.
    timing_error
        Standard deviation of the reversal instants [s].
    fewest_samples
        The N_s of the highest speed.

    Attributes
    ----------
    unseen
        Whether each cell is unseen, shape (columns, rows); False for columns without beams.
    lateness
        Of the servo, compared with steady sweeps.
    """

    def __init__(
        self, task: Task, samples_per_sweep: int, timing_error: float, fewest_samples: int = 1
    ) -> None:
        self._task = task
        self._column_of_step = task.column_of_step()
        starts, widths = column_runs(self._column_of_step)
        self._columns = self._column_of_step[starts]
        self._middle = starts + (widths - 1) / 2.0
        spread = np.linspace(1.0 - SPREAD, 1.0 + SPREAD, CANDIDATES, dtype=np.float64)
        self._candidates = np.maximum(samples_per_sweep * spread, fewest_samples)
        # The effect of errors in both reversals on a beam in mid-sweep, where it is least.
        late = math.sqrt(0.5) * timing_error / task.beam_period
        self.lateness = Lateness(float(self._candidates[-1]), late)
        self._row_height = task.row_height(samples_per_sweep)
        self._fine = min(FINE, math.ceil(self._row_height / CLOSEST))
        edges = np.minimum(np.arange(task.rows + 1) * task.cell, task.span)
        self._row_worth = task.cell / np.diff(edges)
        self.unseen = np.zeros((task.columns, task.rows), dtype=np.bool_)
        self.forget()

    def forget(self) -> None:
        """Mark all cells as unseen."""
        self.unseen[self._columns] = True

    def saw(self, reversal: float, next_reversal: float, going_up: bool) -> Integers:
        """Mark the cells hit between two reversals; return the first sample of each new one, (n,).

        Parameters
        ----------
        reversal, next_reversal
            The true instants at which the sweep began and ended [samples].
        going_up
            Whether it began at the lower limit.
        """
        n = np.arange(max(0, math.ceil(reversal)), math.ceil(next_reversal))
        reversals = np.array([reversal, next_reversal])
        if not going_up:
            reversals = np.array([2.0 * reversal - next_reversal, reversal, next_reversal])
        column = self._column_of_step[n % self._task.steps_per_revolution]
        n, column = n[column >= 0], column[column >= 0]
        row = rows_of(self._task, reversals, n)
        new = self.unseen[column, row]
        _, firsts = np.unique(column[new] * self._task.rows + row[new], return_index=True)
        self.unseen[column, row] = False
        return np.sort(n[new][firsts])

    def saw_beams(self, azimuth: Array, pitch: Array) -> None:
        """Mark the cells that beams hit, by azimuth and pitch [rad], shape (n,) each."""
        task = self._task
        column = self._column_of_step[task.step_at(azimuth)]
        height = (pitch - task.pitch_min) / task.span
        inside = (column >= 0) & _between_limits(height)
        self.unseen[column[inside], task.row_of_height(height[inside], 1)] = False

    def next_duration(
        self, reversal: float, going_up: bool, under_way: tuple[float, float] | None = None
    ) -> float:
        """Return the duration of the sweep that begins at a reversal [samples].

        Parameters
        ----------
        reversal
            The instant of the reversal [samples].
        going_up
            Whether the sweep begins at the lower limit.
        under_way
            Begin and duration of the unseen part of the sweep before it [samples].
        """
        unseen: Array = self.unseen.astype(np.float64)
        if under_way is not None:
            unseen = self._after(unseen, *under_way, not going_up)
        value = self._value(unseen, reversal, going_up, self._candidates)
        best, best_value = 0.0, -math.inf
        for index in _best_apart(value):
            duration = float(self._candidates[index])
            after = self._after(unseen, reversal, duration, going_up)
            following = self._value(after, reversal + duration, not going_up, self._candidates)
            if value[index] + following.max() > best_value:
                best, best_value = duration, float(value[index] + following.max())
        return best

    def _after(self, unseen: Array, reversal: float, duration: float, going_up: bool) -> Array:
        """Return how unseen each cell is after a sweep, whose hits are uncertain."""
        after = unseen.copy()
        column, row = self._hits(reversal, duration, going_up)
        after[column, row] *= DOUBT
        return after

    def _value(self, unseen: Array, reversal: float, going_up: bool, durations: Array) -> Array:
        """Return the worth of the hits of a sweep of each duration."""
        worth = self._worth(unseen)
        since, column = self._passes(reversal, durations[-1])
        progress = self.lateness.progress(since, durations[:, None])
        height = progress if going_up else 1.0 - progress
        index = (height * (self._task.span / self._task.cell * self._fine)).astype(np.int64)
        hit = worth[column, np.clip(index, 0, worth.shape[1] - 1)]
        hits = (since < durations[:, None]) & _between_limits(height)
        return np.asarray(np.where(hits, hit, 0.0).sum(axis=1))

    def _worth(self, unseen: Array) -> Array:
        """Return the worth of a beam at each height of each column, shape (columns, heights).

        Low rows are worth more, since they are hit less often. Cells beside seen ones are worth
        more, so that no single cells remain, each of which takes a sweep of its own. The lateness
        blurs the heights.
        """
        seen_beside = 2.0 - np.roll(unseen, 1, axis=0) - np.roll(unseen, -1, axis=0)
        worth = unseen * self._row_worth * (1.0 + seen_beside)
        heights = max(1, round(self._task.span / self._task.cell * self._fine))
        fine = np.repeat(worth, self._fine, axis=1)[:, :heights]
        blur = _gaussian(self.lateness.spread / self._row_height * self._fine)
        reach = len(blur) // 2
        padded = np.pad(fine, ((0, 0), (reach, reach)), mode='symmetric')
        windows = np.lib.stride_tricks.sliding_window_view(padded, len(blur), axis=1)
        return np.asarray(windows @ blur)

    def _hits(self, reversal: float, duration: float, going_up: bool) -> tuple[Integers, Integers]:
        """Return the columns and rows that a sweep should hit."""
        since, column = self._passes(reversal, duration)
        progress = self.lateness.progress(since, duration)
        hits = _between_limits(progress)
        column, progress = column[hits], progress[hits]
        return column, self._task.row_of_height(progress if going_up else 1.0 - progress, 1)

    def _passes(self, reversal: float, duration: float) -> tuple[Array, Integers]:
        """Return when the lidar passes columns after a reversal [samples], and the columns."""
        revolution = self._task.steps_per_revolution
        first = math.floor(reversal / revolution) - 1
        last = math.ceil((reversal + duration) / revolution)
        since = np.arange(first, last + 1)[:, None] * revolution + self._middle - reversal
        during = (since >= 0.0) & (since < duration)
        return since[during], np.broadcast_to(self._columns, since.shape)[during]


def _between_limits(height: Array) -> Mask:
    """Return which heights [spans] are between the limits: beams beyond them hit no cell."""
    return (height >= -ON_THE_LINE) & (height <= 1.0 + ON_THE_LINE)


def _best_apart(value: Array) -> list[int]:
    """Return the indices of the highest values, at least APART from each other."""
    chosen: list[int] = []
    for index in np.argsort(-value, kind='stable').tolist():
        if all(abs(index - other) >= APART for other in chosen):
            chosen.append(index)
        if len(chosen) == EXAMINED:
            break
    return chosen


def _gaussian(deviation: float) -> Array:
    """Return the weights of a normal distribution at whole numbers, with sum 1."""
    reach = math.ceil(3.0 * deviation)
    at = np.arange(-reach, reach + 1)
    weight = np.exp(-0.5 * (at / max(deviation, 1e-9)) ** 2)
    return np.asarray(weight / weight.sum())
