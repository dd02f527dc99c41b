"""Nods whose sweeps differ in duration: slow upward sweeps that interlace, and fast returns.

The upward and downward sweeps of a steady nod are two even combs; where they coincide, one of them
is wasted. An interlaced nod needs one comb and the time of the returns; docs/nod_schedules.md has
the proof and the measurements.
"""

from dataclasses import dataclass, replace
import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.pattern.pattern import HALF_SAMPLE
from nodlidar_planner.pattern.task import Task
import numpy as np


@dataclass(frozen=True, slots=True)
class Schedule:
    """Sweeps of given durations, alternately up and down, repeated without end.

    Attributes
    ----------
    sweeps
        Their durations [samples], the first one upward; an even number of them.
    phase
        Samples that the nod is past its lower limit, going up, at sample 0.

    Raises
    ------
    ParameterError
        If the number of sweeps is odd or 0, or one is shorter than a sample.
    """

    sweeps: tuple[int, ...]
    phase: float = HALF_SAMPLE

    def __post_init__(self) -> None:
        if not self.sweeps or len(self.sweeps) % 2:
            raise ParameterError('sweeps', 'an even number of sweeps', len(self.sweeps))
        if min(self.sweeps) < 1:
            raise ParameterError('sweeps', 'at least 1 sample each', min(self.sweeps))

    @property
    def period(self) -> int:
        """Samples after which the nod repeats."""
        return sum(self.sweeps)

    def reversals(self, samples: int) -> Array:
        """Return the reversal instants [samples], (k,), from -phase to the first past a sample."""
        periods = math.ceil((samples + self.phase) / self.period) + 1
        ends = np.concatenate([[0.0], np.cumsum(np.tile(self.sweeps, periods))])
        instants: Array = ends - self.phase
        return instants[: np.searchsorted(instants, samples, side='right') + 1]


def whole_rows(task: Task) -> Task:
    """Return the task with slightly wider limits, so that no row is lower than a cell.

    A row that is partly outside the nod's span is hit by fewer beams and delays completion.
    """
    more = (task.rows * task.cell - task.span) / 2.0
    return replace(task, pitch_min=task.pitch_min - more, pitch_max=task.pitch_max + more)


def even_rows(task: Task) -> Task:
    """Return the task for a slightly different object, so that all rows are equally high.

    For a nod whose limits are fixed; see whole_rows. A single row is even already.
    """
    if task.rows == 1:
        return task
    cell = task.span / task.rows
    return replace(task, object_size=2.0 * task.distance * math.sin(cell / 2.0))


def interlaced(task: Task, fewest_samples: int, combs: int, overlap: float = 0.0) -> Schedule:
    """Return a schedule of slow upward sweeps that interlace, and fast returns.

    Each upward sweep passes any azimuth in steps of `combs` cells, less the overlap, displaced by
    a cell's height from the sweeps before it. So the upward sweeps of one period hit the object
    wherever it is in the region. One comb completes soonest; with more combs, the whole view is
    seen sooner, but coarsely.

    Parameters
    ----------
    task
        Region, cells and lidar; see whole_rows.
    fewest_samples
        Samples in a sweep at the highest speed; no sweep has fewer.
    combs
        Number of upward sweeps that interlace.
    overlap
        Part of a cell's height by which neighbouring beams are closer than a cell; [0, 1). It
        absorbs errors of the reversal instants.

    Raises
    ------
    ParameterError
        If `combs` or `overlap` is out of its range.
    """
    if combs < 1:
        raise ParameterError('combs', 'at least 1', combs)
    if not 0.0 <= overlap < 1.0:
        raise ParameterError('overlap', 'at least 0 and below 1', overlap)
    revolution = task.steps_per_revolution
    rows = task.span / task.cell
    up = max(fewest_samples, math.ceil(rows * revolution / (combs * (1.0 - overlap))))
    revolutions = coprime_from(math.ceil((up + fewest_samples) * combs / revolution), combs)
    # The last cycle ends with a whole revolution; those before it, to half a sample, evenly.
    ends = np.rint(np.arange(combs + 1) * (revolutions * revolution / combs)).astype(np.int64)
    while np.diff(ends).min() < up + fewest_samples:
        revolutions = coprime_from(revolutions + 1, combs)
        ends = np.rint(np.arange(combs + 1) * (revolutions * revolution / combs)).astype(np.int64)
    return Schedule(tuple(int(d) for end in np.diff(ends) for d in (up, end - up)))


def shortest_interlaced(
    task: Task, fewest_samples: int, most_samples: int, overlap: float = 0.0
) -> Schedule:
    """Return the interlaced schedule with the fewest combs whose sweeps are within a speed band.

    Raises
    ------
    ParameterError
        If the band is too narrow for any schedule.
    """
    if most_samples < fewest_samples:  # without a search, which would be long
        raise ParameterError('most_samples', f'well above {fewest_samples}', most_samples)
    rows = task.span / task.cell
    fewest = math.ceil(rows * task.steps_per_revolution / ((1.0 - overlap) * most_samples))
    for combs in range(fewest, 2 * math.ceil(rows) + fewest):
        schedule = interlaced(task, fewest_samples, combs, overlap)
        if max(schedule.sweeps) <= most_samples:
            return schedule
    raise ParameterError('most_samples', f'well above {fewest_samples}', most_samples)


def rows_of(task: Task, reversals: Array, samples: Integers) -> Integers:
    """Return the row of each sample, for sweeps between given reversals.

    Parameters
    ----------
    task
        The nod reaches its limits at each reversal.
    reversals
        Their instants [samples], ascending, shape (t,); the first at the lower limit.
    samples
        Shape (n,), between the first reversal and the last.
    """
    sweeps = np.interp(samples, reversals, np.arange(len(reversals))) % 2.0
    return task.row_of_height(1.0 - np.abs(sweeps - 1.0), samples_per_sweep=1)


def first_hits(task: Task, reversals: Array) -> Array:
    """Return the first sample that hits each cell, shape (columns, rows).

    Infinite for a cell that no sample before the last reversal hits.
    """
    samples = np.arange(math.ceil(reversals[-1]))
    column = task.column_of_step()[samples % task.steps_per_revolution]
    cell = _cells(task, column, rows_of(task, reversals, samples))
    first = np.full(task.cells + 1, np.inf)
    first[cell[::-1]] = samples[::-1]
    return first[:-1].reshape(task.columns, task.rows)


def _cells(task: Task, column: Integers, row: Integers) -> Integers:
    """Return each sample's cell; one past the last for samples outside the region."""
    return np.where(column >= 0, column * task.rows + row, task.cells)
