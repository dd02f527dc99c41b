"""The N_s that complete soonest, without evaluating all of them.

No column completes later than all columns do. So the completion of a single column, computed for
many N_s at once, is a lower bound for each; only N_s whose bound beats the best so far are
evaluated.
"""

import math
from typing import Any

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_planner.choice.plan import Progress
from nodlidar_planner.coverage.coverage import Coverage, reversal_reach
from nodlidar_planner.pattern.start import pattern_from, phase_at
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np
from numpy.typing import DTypeLike, NDArray

AnyFloats = NDArray[np.floating[Any]]

# So few N_s or fewer are evaluated without bounds.
FEW = 3
# After this many columns the most promising N_s is evaluated, for a better time to beat.
EVALUATED_AFTER = (2, 8, 32)
# So many N_s that tie with the last of the best are evaluated: all tie where there is one row.
MOST_TIES = 100
# One of this many N_s is examined first, for the same reason.
THINNING = 16
# Rows of a column that are tracked: one for each bit of an integer but the sign.
WATCHED_ROWS = 63
# N_s whose columns are computed together, as fits the processor's cache.
BLOCK = 128
# A bound may be this much too low [samples], so single precision suffices up to this sample.
ROUNDING = 0.05
SINGLE_PRECISION = 2**18


def soonest(
    task: Task,
    samples: Integers,
    margin: float = 0.0,
    count: int = 1,
    start_pitch: float | None = None,
    limit: float = math.inf,
    progress: Progress = iter,
) -> tuple[Integers, Array]:
    """Return the N_s that complete soonest, and their times.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples
        The N_s to choose from, shape (n,).
    margin
        See Coverage.
    count
        How many to return: fewer if no more complete, more if others tie with the last, of which
        MOST_TIES are looked for.
    start_pitch
        See `phase_at`.
    limit
        Upper limit of the completion time, exclusive [s].
    progress
        Wraps the iteration over the columns, to show progress.

    Returns
    -------
    N_s and completion times [s], soonest first; ties in the order of `samples`.
    """
    samples = samples[_bears(task, samples, margin)]
    search = _Search(task, margin, count, start_pitch, limit, progress)
    thinning = 1
    while len(samples) > thinning * max(FEW, count):
        thinning *= THINNING
    while thinning:
        search.examine(samples[::thinning])
        thinning //= THINNING
    return search.best(samples)


def _bears(task: Task, samples: Integers, margin: float) -> Mask:
    """Return for which N_s the second row from below is high enough for a margin on both sides."""
    if task.rows < 3:
        return np.ones(len(samples), dtype=np.bool_)
    part = np.array(min(2.0 * task.cell / task.span, 0.5))  # where in the row the margin is least
    return np.asarray(samples * task.row_height(1) >= 2.0 * reversal_reach(margin, part))


def spread(count: int) -> Integers:
    """Return 0 .. count - 1 in an order whose first elements, however many, are spread evenly."""
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    return np.argsort(np.argsort(np.arange(count) * golden % 1.0))


class _Search:
    """The completion times computed so far, and the bounds that decide which others to compute."""

    def __init__(
        self,
        task: Task,
        margin: float,
        count: int,
        start_pitch: float | None,
        limit: float,
        progress: Progress,
    ) -> None:
        self._task = task
        self._margin = margin
        self._count = count
        self._start_pitch = start_pitch
        self._progress = progress
        self._times: dict[int, float] = {}
        self._limit = self._to_beat = limit

    def examine(self, samples: Integers) -> None:
        """Evaluate all N_s that may be among the best."""
        bound = self._bounds(samples)
        for index in np.argsort(bound, kind='stable'):
            if bound[index] > self._to_beat or (bound[index] == self._to_beat and self._many_tie):
                break
            self._evaluate(int(samples[index]))

    @property
    def _many_tie(self) -> bool:
        return list(self._times.values()).count(self._to_beat) > MOST_TIES

    def best(self, samples: Integers) -> tuple[Integers, Array]:
        """Return the best of the N_s that were evaluated, and their times [s]."""
        known = np.array([n_s for n_s in samples if int(n_s) in self._times], dtype=np.int64)
        times = np.array([self._times[int(n_s)] for n_s in known])
        last = times[np.argsort(times)[: self._count]].max(initial=0.0)
        order = np.argsort(times, kind='stable')
        order = order[(times[order] <= last) & (times[order] < self._limit)]
        return known[order], times[order]

    def _bounds(self, samples: Integers) -> Array:
        """Return lower bounds of the completion times, until few are below the time to beat."""
        starts, widths = column_runs(self._task.column_of_step())
        bound = np.zeros(len(samples))
        for visited, column in enumerate(self._progress(spread(len(starts))), start=1):
            open_ = np.flatnonzero(bound < self._to_beat)
            if not math.isfinite(self._to_beat) or len(open_) <= FEW:
                break
            column_bound = column_completion(
                self._task,
                samples[open_],
                int(starts[column]),
                int(widths[column]),
                math.ceil(self._to_beat * self._task.scan_rate) + 1,
                self._margin,
                self._start_pitch,
            )
            bound[open_] = np.maximum(bound[open_], column_bound)
            if visited in EVALUATED_AFTER:
                self._evaluate(int(samples[open_[np.argmin(bound[open_])]]))
        return bound

    def _evaluate(self, samples_per_sweep: int) -> None:
        if samples_per_sweep not in self._times:
            pattern = pattern_from(self._task, samples_per_sweep, self._start_pitch)
            coverage = Coverage(self._task, pattern, self._margin)
            self._times[samples_per_sweep] = coverage.completion_time()
            times = sorted([*self._times.values(), *[self._limit] * self._count])
            self._to_beat = times[self._count - 1]


def column_completion(
    task: Task,
    samples: Integers,
    start: int,
    width: int,
    revolutions: int,
    margin: float,
    start_pitch: float | None = None,
) -> Array:
    """Return a time before which a column is not complete, for each N_s; shape (n,) [s].

    It is exact where rows are higher than a column is wide; otherwise rows that the nod passes
    between two samples count as hit. Infinite if not complete after the revolutions.
    """
    begin = start + task.steps_per_revolution * np.arange(revolutions)
    entry = np.maximum(begin, 0)
    widths = begin + width - entry
    phase = phase_at(task, samples, start_pitch)
    bounds = np.empty(len(samples))
    for first in range(0, len(samples), BLOCK):
        block = slice(first, first + BLOCK)
        bounds[block] = _column_completion(
            task, samples[block, None], phase[block, None], entry, widths, margin
        )
    return bounds


def _column_completion(
    task: Task, samples: Integers, phase: Array, entry: Integers, widths: Integers, margin: float
) -> Array:
    """Return the bounds for N_s of shape (n, 1), and passes of shape (passes,)."""
    precision: DTypeLike = np.float32 if entry[-1] < SINGLE_PRECISION else np.float64
    n_s: AnyFloats = samples.astype(precision)
    begin = entry.astype(precision) + phase.astype(precision)
    low, high = _passed(n_s, begin, widths.astype(precision))
    height = task.row_height(1) * n_s
    last = min(task.rows, WATCHED_ROWS) - 1
    if margin > 0.0:
        low = low + reversal_reach(margin, low / n_s)
        high = high - reversal_reach(margin, high / n_s)
    first_row = np.clip(np.floor((low - ROUNDING) / height), 0, task.rows - 1).astype(np.int64)
    last_row = np.clip(np.floor((high + ROUNDING) / height), 0, last).astype(np.int64)
    inside = (first_row <= last_row) & (first_row <= last)
    hit = (np.int64(2) << last_row) - (np.int64(1) << np.minimum(first_row, last))
    seen = np.bitwise_or.accumulate(np.where(inside, hit, 0), axis=1)
    complete = seen == (1 << (last + 1)) - 1
    when = entry[np.argmax(complete, axis=1)] * task.beam_period
    return np.where(complete[:, -1], when, np.inf)


def _passed(n_s: AnyFloats, entry: AnyFloats, widths: AnyFloats) -> tuple[AnyFloats, AnyFloats]:
    """Return the lowest and the highest height during each pass of a column, (N_s, passes)."""
    cycle = 2 * n_s
    begin = entry - np.floor(entry / cycle) * cycle
    end = begin + (widths - 1)
    at_begin, at_end = n_s - np.abs(begin - n_s), np.abs(n_s - np.abs(end - n_s))
    low = (end < cycle) * np.minimum(at_begin, at_end)
    high = np.where((begin <= n_s) & (end >= n_s), n_s, np.maximum(at_begin, at_end))
    return low, high
