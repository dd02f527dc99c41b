"""Completion and holes under a timing error, from simulated runs of a nod."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.holes.hole import largest_hole, samples_taken
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np

# Longest run, in revolutions for each row: twenty times what random hits need.
REVOLUTIONS_PER_ROW = 100
# Revolutions that are computed at once.
BLOCK = 64
# Runs whose results are remembered: a choice looks again at the best candidates, with more runs.
MOST_REMEMBERED = 4096


@dataclass(frozen=True, slots=True)
class UnderError:
    """Completion times, or largest holes, with white noise in the reversal instants.

    Attributes
    ----------
    error
        Standard deviation of the reversal instants [s].
    median, expected, p90
        Median, mean and 90th percentile of the completion time [s], or of the hole's side [rad].
    """

    error: float
    median: float
    expected: float
    p90: float


def under_error(task: Task, pattern: Pattern, error: float, seeds: Iterable[int]) -> UnderError:
    """Return the completion times of runs, one for each seed."""
    n_s, phase = pattern.samples_per_sweep, pattern.phase
    times = [completion_run(task, n_s, phase, error, seed) for seed in seeds]
    return _summary(error, times)


def hole_under_error(
    task: Task, pattern: Pattern, duration: float, error: float, seeds: Iterable[int]
) -> UnderError:
    """Return the largest holes of runs after a time [s], one for each seed."""
    holes = [
        largest_hole(task, pattern, duration, late_reversals(task, pattern, duration, error, seed))
        for seed in seeds
    ]
    return _summary(error, [hole.side for hole in holes])


def late_reversals(
    task: Task, pattern: Pattern, duration: float, error: float, seed: int
) -> Array:
    """Return the reversal instants of a run [samples], shape (k,), as `largest_hole` needs them.

    Duration and error (a standard deviation) are in seconds; see `reversal_instants`.
    """
    last = samples_taken(task, duration)
    samples_per_sweep, phase = pattern.samples_per_sweep, pattern.phase
    return reversal_instants(samples_per_sweep, phase, error / task.beam_period, last, seed)


def _summary(error: float, values: Sequence[float]) -> UnderError:
    # Not interpolated, since values may be infinite.
    p90 = np.quantile(values, 0.9, method='higher')
    median = np.quantile(values, 0.5, method='higher')
    return UnderError(error, float(median), float(np.mean(values)), float(p90))


@lru_cache(maxsize=MOST_REMEMBERED)
def completion_run(
    task: Task, samples_per_sweep: int, phase: float, error: float, seed: int
) -> float:
    """Return the completion time of one run [s]; infinite beyond REVOLUTIONS_PER_ROW.

    Between reversals the speed is constant. A cell counts as hit when the lidar enters its column
    if the nod is in its row before the lidar leaves the column. Where a row is lower than the nod
    moves in a sample, samples count instead.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples_per_sweep, phase
        The nod: N_s, and samples that it is past its lower limit at sample 0.
    error
        Standard deviation of the reversal instants [s].
    seed
        Of the random errors.
    """
    column_of_step = task.column_of_step()
    starts, widths = column_runs(column_of_step)
    if min(1.0, task.last_row) * task.row_height(samples_per_sweep) < 1.0:
        starts = np.flatnonzero(column_of_step >= 0)
        widths = np.ones_like(starts)
    order = np.argsort(starts)
    starts, widths = starts[order], widths[order]
    column = column_of_step[starts]
    if len(np.unique(column)) < task.columns:
        return math.inf
    revolutions = REVOLUTIONS_PER_ROW * task.rows
    last = revolutions * task.steps_per_revolution
    reversals = reversal_instants(samples_per_sweep, phase, error / task.beam_period, last, seed)
    seen = np.zeros((task.columns, task.rows), dtype=bool)
    for begin in range(0, revolutions, BLOCK):
        revolution = np.arange(begin, begin + BLOCK)[:, None]
        begins = starts + task.steps_per_revolution * revolution
        entry = np.maximum(begins, 0)
        low, high = rows_passed(task, reversals, entry, begins + widths - 1)
        first = _first_hits(entry, low, high, np.broadcast_to(column, low.shape), seen.shape)
        unseen = np.where(seen, -1, first)
        if unseen.max() < NEVER:
            return float(unseen.max() * task.beam_period)
        seen |= first < NEVER
        # The last cells take most of the time, and are in few columns.
        going_on = ~seen.all(axis=1)[column]
        starts, widths, column = starts[going_on], widths[going_on], column[going_on]
    return math.inf


def reversal_instants(
    samples_per_sweep: int, phase: float, error: float, last: int, seed: int
) -> Array:
    """Return the reversal instants [samples], shape (k,), from the lower limit before sample 0 on.

    Parameters
    ----------
    samples_per_sweep, phase
        The planned nod.
    error
        Standard deviation of the reversal instants [samples]; they stay in order.
    last
        The sample up to which reversals are needed.
    seed
        Of the random errors.
    """
    far = int(4.0 * error / samples_per_sweep)  # sweeps by which a reversal may be off
    sweep = np.arange(-2 - 2 * far, last // samples_per_sweep + 5 + 2 * far)
    noise = np.random.default_rng(seed).normal(0.0, error, len(sweep))
    return np.asarray(np.maximum.accumulate(sweep * samples_per_sweep - phase + noise))


def rows_passed(
    task: Task, reversals: Array, entry: Integers, last: Integers
) -> tuple[Integers, Integers]:
    """Return the lowest and the highest row of the nod during each pass of a column.

    Parameters
    ----------
    task
        Its cells.
    reversals
        See reversal_instants.
    entry, last
        The first and the last sample of each pass, of equal shape.
    """
    sweep = np.arange(-2.0, len(reversals) - 2)
    begin = np.interp(entry, reversals, sweep)
    end = np.interp(last, reversals, sweep)
    at_begin, at_end = _height(begin), _height(end)
    low, high = np.minimum(at_begin, at_end), np.maximum(at_begin, at_end)
    reversal = np.floor(end)
    passed = reversal > begin
    high = np.where(passed & (reversal % 2 == 1), 1.0, high)
    low = np.where(passed & (reversal % 2 == 0), 0.0, low)
    several = reversal - np.floor(begin) > 1
    low, high = np.where(several, 0.0, low), np.where(several, 1.0, high)
    return task.row_of_height(low, 1), task.row_of_height(high, 1)


def _height(sweep: Array) -> Array:
    """Return the height, as a part of the span, at a time in sweeps."""
    below: Array = np.abs(sweep % 2.0 - 1.0)
    return 1.0 - below


def _first_hits(
    entry: Integers, low: Integers, high: Integers, column: Integers, cells: tuple[int, ...]
) -> Integers:
    """Return the first sample of the first pass that hits each cell, shape (columns, rows).

    A pass hits the rows low to high of a column; all of shape (revolutions, passes), ascending.
    NEVER stands for none.
    """
    first = np.full(cells, NEVER)
    for further in range(int((high - low).max()) + 1):
        hit = low + further <= high
        earlier = np.full_like(first, NEVER)
        earlier[column[hit][::-1], low[hit][::-1] + further] = entry[hit][::-1]
        np.minimum(first, earlier, out=first)
    return first
