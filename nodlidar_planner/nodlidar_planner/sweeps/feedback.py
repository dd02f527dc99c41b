"""The next sweep chosen for what has not been seen yet, knowing where the beams really went.

No servo turns on time to the beam, so the planned pattern never happens exactly. But where the
beams fell is known, and so is how far off the next turn may be. The duration of the next sweep is
chosen, not far from the planned one, for the unseen cells that it and the one after it will hit.
"""

import math

from nodlidar_planner.pattern.task import column_runs, ON_THE_LINE, Task
from nodlidar_planner.sweeps.lateness import Lateness
from nodlidar_planner.sweeps.schedule import rows_of
import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

# Durations to choose from: so far from the planned one, and so many.
SPREAD = 0.15
CANDIDATES = 61
# Of the sweep to come the best so many, so far apart, are looked at with the one that follows.
LOOKED_AT, APART = 4, 5
# Heights that are told apart in a row: so many, but none closer than so many samples, by which a
# servo is off anyway.
FINE, CLOSEST = 8, 12
# What a cell that the sweep to come should hit is still worth to the one after it.
DOUBT = 0.15


class Feedback:
    """The cells that are unseen, and the choice of the next sweep.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples_per_sweep
        The planned duration of a sweep.
    timing_error
        Standard deviation of the turns' instants [s].
    fewest_samples
        The N_s of the highest speed.

    Attributes
    ----------
    unseen
        Whether each cell is unseen, shape (columns, rows); not where no step can see it.
    lateness
        Of the servo, against steady sweeps.
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
        # In mid-sweep, where it is least, the error of a turn displaces a beam by 0.7 of it.
        late = math.sqrt(0.5) * timing_error / task.sample_time
        self.lateness = Lateness(float(self._candidates[-1]), late)
        self._row_height = task.row_height(samples_per_sweep)
        self._fine = min(FINE, math.ceil(self._row_height / CLOSEST))
        edges = np.minimum(np.arange(task.rows + 1) * task.cell, task.span)
        self._row_worth = task.cell / np.diff(edges)
        self.unseen = np.zeros((task.columns, task.rows), dtype=np.bool_)
        self.forget()

    def forget(self) -> None:
        """Take all cells for unseen again."""
        self.unseen[self._columns] = True

    def saw(self, turn: float, next_turn: float, going_up: bool) -> Integers:
        """Mark what the samples between two turns hit; return the first that hit each new cell.

        Parameters
        ----------
        turn, next_turn
            The instants at which the sweep really began and ended, in samples.
        going_up
            Whether it began at the lower limit.
        """
        n = np.arange(max(0, math.ceil(turn)), math.ceil(next_turn))
        turns = np.array([turn, next_turn])
        if not going_up:
            turns = np.array([2.0 * turn - next_turn, turn, next_turn])
        column = self._column_of_step[n % self._task.steps_per_revolution]
        n, column = n[column >= 0], column[column >= 0]
        row = rows_of(self._task, turns, n)
        new = self.unseen[column, row]
        _, firsts = np.unique(column[new] * self._task.rows + row[new], return_index=True)
        self.unseen[column, row] = False
        return np.sort(n[new][firsts])

    def saw_beams(self, azimuth: Floats, pitch: Floats) -> None:
        """Mark what beams hit, whether they measured something or not; azimuth, pitch [rad]."""
        task = self._task
        column = self._column_of_step[task.step_at(azimuth)]
        height = (pitch - task.pitch_min) / task.span
        inside = (column >= 0) & (height >= -ON_THE_LINE) & (height <= 1.0 + ON_THE_LINE)
        self.unseen[column[inside], task.row_of_height(height[inside], 1)] = False

    def next_duration(
        self, turn: float, going_up: bool, under_way: tuple[float, float] | None = None
    ) -> float:
        """Return the duration of the sweep that begins at a turn, in samples.

        Parameters
        ----------
        turn
            The instant of the turn, in samples.
        going_up
            Whether the sweep begins at the lower limit.
        under_way
            Instant and duration of the sweep before it, in samples, as far as it was not seen.
        """
        unseen: Floats = self.unseen.astype(np.float64)
        if under_way is not None:
            unseen = self._after(unseen, *under_way, not going_up)
        value = self._value(unseen, turn, going_up, self._candidates)
        best, best_value = 0.0, -math.inf
        for index in _best_apart(value):
            duration = float(self._candidates[index])
            after = self._after(unseen, turn, duration, going_up)
            following = self._value(after, turn + duration, not going_up, self._candidates)
            if value[index] + following.max() > best_value:
                best, best_value = duration, float(value[index] + following.max())
        return best

    def _after(self, unseen: Floats, turn: float, duration: float, going_up: bool) -> Floats:
        """Return how much of each cell is unseen after a sweep that is not sure to hit."""
        after = unseen.copy()
        column, row = self._hits(turn, duration, going_up)
        after[column, row] *= DOUBT
        return after

    def _value(self, unseen: Floats, turn: float, going_up: bool, durations: Floats) -> Floats:
        """Return what the hits of a sweep of each duration are worth."""
        worth = self._worth(unseen)
        since, column = self._passes(turn, durations[-1])
        progress = self.lateness.progress(since, durations[:, None])
        height = progress if going_up else 1.0 - progress
        index = (height * (self._task.span / self._task.cell * self._fine)).astype(np.int64)
        hit = worth[column, np.minimum(index, worth.shape[1] - 1)]
        return np.asarray(np.where(since < durations[:, None], hit, 0.0).sum(axis=1))

    def _worth(self, unseen: Floats) -> Floats:
        """Return what a beam at each height of each column is worth, (columns, heights).

        Low rows are hit the more seldom. Cells beside seen ones are worth more: what is left
        shall not be crumbs, each of which takes a sweep of its own. The error of the turns blurs
        the heights.
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

    def _hits(self, turn: float, duration: float, going_up: bool) -> tuple[Integers, Integers]:
        """Return the columns and rows that a sweep should hit."""
        since, column = self._passes(turn, duration)
        progress = self.lateness.progress(since, duration)
        return column, self._task.row_of_height(progress if going_up else 1.0 - progress, 1)

    def _passes(self, turn: float, duration: float) -> tuple[Floats, Integers]:
        """Return when the lidar passes columns after a turn [samples], and which."""
        revolution = self._task.steps_per_revolution
        first, last = math.floor(turn / revolution) - 1, math.ceil((turn + duration) / revolution)
        since = np.arange(first, last + 1)[:, None] * revolution + self._middle - turn
        during = (since >= 0.0) & (since < duration)
        return since[during], np.broadcast_to(self._columns, since.shape)[during]


def _best_apart(value: Floats) -> list[int]:
    """Return the indices of the highest values, some way apart from each other."""
    chosen: list[int] = []
    for index in np.argsort(-value, kind='stable').tolist():
        if all(abs(index - other) >= APART for other in chosen):
            chosen.append(index)
        if len(chosen) == LOOKED_AT:
            break
    return chosen


def _gaussian(deviation: float) -> Floats:
    """Return the weights of a normal distribution at whole numbers, which add up to 1."""
    reach = math.ceil(3.0 * deviation)
    at = np.arange(-reach, reach + 1)
    weight = np.exp(-0.5 * (at / max(deviation, 1e-9)) ** 2)
    return np.asarray(weight / weight.sum())
