"""Completion and holes when the servo does not turn on time: runs of a nod with late turns."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math

from nodlidar_planner.holes.hole import largest_hole, samples_taken
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# A run is given up after this many revolutions for each row: twenty times what random hits need.
REVOLUTIONS_PER_ROW = 100
# Revolutions that are computed at once.
BLOCK = 64


@dataclass(frozen=True, slots=True)
class UnderError:
    """Completion times, or largest holes, when the turns' instants are off by white noise.

    Attributes
    ----------
    error
        Standard deviation of the turns' instants [s].
    median, expected, p90
        Median, mean and 90th percentile of the completion time [s], or of the hole's side [rad].
    """

    error: float
    median: float
    expected: float
    p90: float


def under_error(task: Task, pattern: Pattern, error: float, seeds: Iterable[int]) -> UnderError:
    """Return what the completion times of runs are, one for each seed."""
    n_s, phase = pattern.samples_per_sweep, pattern.phase
    times = [completion_run(task, n_s, phase, error, seed) for seed in seeds]
    return _summary(error, times)


def hole_under_error(
    task: Task, pattern: Pattern, duration: float, error: float, seeds: Iterable[int]
) -> UnderError:
    """Return what the largest holes of runs are after a time [s], one for each seed."""
    holes = [
        largest_hole(task, pattern, duration, late_turns(task, pattern, duration, error, seed))
        for seed in seeds
    ]
    return _summary(error, [hole.side for hole in holes])


def late_turns(task: Task, pattern: Pattern, duration: float, error: float, seed: int) -> Floats:
    """Return the turns [samples] of a run for a time, as `largest_hole` takes them.

    The error is a standard deviation [s]; see `turn_instants`.
    """
    last = samples_taken(task, duration)
    samples_per_sweep, phase = pattern.samples_per_sweep, pattern.phase
    return turn_instants(samples_per_sweep, phase, error / task.sample_time, last, seed)


def _summary(error: float, values: Sequence[float]) -> UnderError:
    # Of infinite ones there is no interpolation.
    p90 = np.quantile(values, 0.9, method='higher')
    median = np.quantile(values, 0.5, method='higher')
    return UnderError(error, float(median), float(np.mean(values)), float(p90))


def completion_run(
    task: Task, samples_per_sweep: int, phase: float, error: float, seed: int
) -> float:
    """Return the completion time of one run [s]; infinite if it takes unreasonably long.

    Between turns the speed is constant. A cell counts as hit from where the lidar enters its
    column, if the nod is in its row before the lidar leaves the column.

    Parameters
    ----------
    task
        What must be covered.
    samples_per_sweep, phase
        The nod: N_s, and samples that it is past its lower limit at sample 0.
    error
        Standard deviation of the instants of the turns [s].
    seed
        Of the random errors.
    """
    starts, widths = column_runs(task.column_of_step())
    if len(starts) < task.columns:
        return math.inf
    order = np.argsort(starts)
    starts, widths = starts[order], widths[order]
    revolutions = REVOLUTIONS_PER_ROW * task.rows
    last = revolutions * task.steps_per_revolution
    turns = turn_instants(samples_per_sweep, phase, error / task.sample_time, last, seed)
    seen = np.zeros((len(starts), task.rows), dtype=bool)
    for begin in range(0, revolutions, BLOCK):
        revolution = np.arange(begin, begin + BLOCK)[:, None]
        entry = starts + task.steps_per_revolution * revolution
        low, high = rows_passed(task, turns, entry, widths)
        hits = _first_hits(low, high, task.rows)
        unseen = np.where(seen, -1, hits)
        if unseen.max() < BLOCK:
            final = unseen.max()
            column = np.max(np.nonzero((unseen == final).any(axis=1))[0])
            return float(entry[final, column] * task.sample_time)
        seen |= hits < BLOCK
    return math.inf


def turn_instants(
    samples_per_sweep: int, phase: float, error: float, last: int, seed: int
) -> Floats:
    """Return when the nod turns [samples], at the lower limit first, before sample 0.

    Parameters
    ----------
    samples_per_sweep, phase
        The nod as it should be.
    error
        Standard deviation of the turns' instants [samples]. None overtakes the one before.
    last
        The sample up to which turns are needed.
    seed
        Of the random errors.
    """
    far = int(4.0 * error / samples_per_sweep)  # sweeps by which turns may be off
    sweep = np.arange(-2 - 2 * far, last // samples_per_sweep + 5 + 2 * far)
    noise = np.random.default_rng(seed).normal(0.0, error, len(sweep))
    return np.asarray(np.maximum.accumulate(sweep * samples_per_sweep - phase + noise))


def rows_passed(
    task: Task, turns: Floats, entry: Integers, widths: Integers
) -> tuple[Integers, Integers]:
    """Return the lowest and the highest row that the nod is in during each pass of a column.

    Parameters
    ----------
    turns
        See turn_instants.
    entry, widths
        The first sample of each pass, and how many it has; shapes that broadcast.
    """
    sweep = np.arange(-2.0, len(turns) - 2)
    begin, end = np.interp(entry, turns, sweep), np.interp(entry + widths - 1, turns, sweep)
    at_begin, at_end = _height(begin), _height(end)
    low, high = np.minimum(at_begin, at_end), np.maximum(at_begin, at_end)
    turn = np.floor(end)
    turned = turn > begin
    high = np.where(turned & (turn % 2 == 1), 1.0, high)
    low = np.where(turned & (turn % 2 == 0), 0.0, low)
    return task.row_of_height(low, 1), task.row_of_height(high, 1)


def _height(sweep: Floats) -> Floats:
    """Return the height in spans at a time in sweeps."""
    below: Floats = np.abs(sweep % 2.0 - 1.0)
    return 1.0 - below


def _first_hits(low: Integers, high: Integers, rows: int) -> Integers:
    """Return the first pass of each column in which each row is hit, (columns, rows).

    Rows low to high, shapes (passes, columns), are hit; the number of passes where none is.
    """
    passes, columns = low.shape
    first = np.full((columns, rows), passes)
    number = np.broadcast_to(np.arange(passes)[:, None], low.shape)
    column = np.broadcast_to(np.arange(columns), low.shape)
    for further in range(int((high - low).max()) + 1):
        hit = (low + further <= high)[::-1]
        earlier = np.full_like(first, passes)
        earlier[column[::-1][hit], (low + further)[::-1][hit]] = number[::-1][hit]
        np.minimum(first, earlier, out=first)
    return first
