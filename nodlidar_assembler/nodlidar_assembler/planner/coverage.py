"""How a scan pattern covers the cells of a task, exactly, without going through its samples.

Sample n has azimuth step n mod N_L and residue n mod 2 N_s, which tells its row. A column is a run
of steps; the residues at which the lidar enters it, revolution by revolution, are a rotation of
the circle of 2 N_s residues by N_L. With g = gcd(N_L, 2 N_s), columns that start at steps equal
modulo g and are equally wide are crossed alike, some revolutions apart. So there are few classes
of columns, and the crossings of one column of each class, in order, tell those of all cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from nodlidar_assembler.planner.pattern import Pattern
from nodlidar_assembler.planner.task import Task
from nodlidar_common.errors import ParameterError
import numpy as np
from numpy.typing import NDArray

# The first hit of a cell that is never hit.
NEVER = np.iinfo(np.int64).max
# Bounds on memory; the closed forms of Pattern have none.
MAX_SAMPLES_PER_SWEEP = 1_000_000
MAX_CELLS = 20_000_000

Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Figures:
    """How well a pattern covers the cells of a task, over its whole period.

    Attributes
    ----------
    completion_time
        Time until every cell was hit once [s]; infinite if some never is.
    revisit_max, revisit_mean
        The longest time between two crossings of a cell [s]: the largest over the cells, and their
        mean; infinite if some cell is never hit.
    hit_frequency
        Crossings of a cell per second [Hz], mean over the cells.
    cells
        Number of cells.
    never_hit_share
        Share of the cells that are never hit.
    """

    completion_time: float
    revisit_max: float
    revisit_mean: float
    hit_frequency: float
    cells: int
    never_hit_share: float


@dataclass(frozen=True, slots=True)
class _ColumnClass:
    """Columns that are crossed alike.

    Attributes
    ----------
    columns, starts
        Their numbers among the columns that the lidar sees, and their first steps; shape (c,).
    key
        The crossings of the first of them in one period, ascending, shape (k,): row * period + the
        sample at which it begins, counted from the column's first step in revolution 0.
    bounds
        Where each row's crossings begin in the key, and where the last's end; shape (rows + 1,).
    """

    columns: Integers
    starts: Integers
    key: Integers
    bounds: Integers


class Coverage:
    """The coverage of a task's cells by a pattern.

    A cell is hit by the samples whose step is in its column and whose pitch in its row;
    consecutive samples in one cell are one crossing, which counts from its first sample.

    Parameters
    ----------
    task
        Region, cells and lidar.
    pattern
        Of the same N_L.
    guard
        Error of the turns, in samples: what `turn_reach` makes of it is how far a sample must
        stay away from the next row to count as a hit.

    Raises
    ------
    ParameterError
        If the N_L differ, or N_s or the number of cells is too large for the computer's memory.
    """

    def __init__(self, task: Task, pattern: Pattern, guard: float = 0.0) -> None:
        _check(task, pattern)
        self._task = task
        self.pattern = pattern
        self._column_of = task.column_of_step()
        self._row_of, self._rows = _rows_of_residue(task, pattern, guard)
        starts, widths = column_runs(self._column_of)
        self._check_memory(min(len(starts), 2 * pattern.stride))
        self._seen = self._column_of[starts]
        self._classes = list(self._column_classes(starts, widths))
        self._never_left = (
            len(widths) == 1
            and widths[0] == len(self._column_of)
            and (bool(np.all(self._row_of == 0)))
        )

    def first_hits(self, start: int = 0) -> Integers:
        """Return the samples from a starting sample to each cell's first hit from then on.

        Starting at another sample is starting the nod at another pitch (docs/model.md).

        Returns
        -------
        Shape (columns that the lidar sees, rows that are hit, from below); NEVER where none comes.
        """
        self._check_memory(len(self._seen))
        first = np.full((len(self._seen), self._rows), NEVER)
        for column_class in self._classes:
            first[column_class.columns] = self._first_hits_of(column_class, start)
        step, residue = start % len(self._column_of), start % len(self._row_of)
        if self._column_of[step] >= 0 and self._row_of[residue] >= 0:
            column = np.searchsorted(self._seen, self._column_of[step])
            first[column, self._row_of[residue]] = 0
        return first

    def completion_time(self, start: int = 0) -> float:
        """Return the time from a sample until every cell was hit [s], infinite if never."""
        if self.never_hit_share() > 0.0:
            return np.inf
        return float(self.first_hits(start).max()) * self._task.sample_time

    def never_hit_share(self) -> float:
        """Return the share of all cells that are never hit."""
        hit = int(self._never_left)
        for c in self._classes:
            hit += np.count_nonzero(np.diff(c.bounds)) * len(c.columns)
        return float(1.0 - hit / self._task.cells) if hit < self._task.cells else 0.0

    def figures(self) -> Figures:
        """Return the figures of the whole period, and the completion from sample 0."""
        share = self.never_hit_share()
        period = self.pattern.period
        longest, crossings, sum_of_longest = 0, 0, 0
        for c in self._classes:
            gaps = _longest_gaps(c, period)
            longest = max(longest, int(gaps.max(initial=0)))
            sum_of_longest += int(gaps.sum()) * len(c.columns)
            crossings += len(c.key) * len(c.columns)
        if self._never_left:
            crossings = 1
        time = self._task.sample_time
        return Figures(
            completion_time=self.completion_time(),
            revisit_max=longest * time if share == 0.0 else np.inf,
            revisit_mean=sum_of_longest / self._task.cells * time if share == 0.0 else np.inf,
            hit_frequency=crossings / (self._task.cells * period * time),
            cells=self._task.cells,
            never_hit_share=share,
        )

    def _check_memory(self, columns: int) -> None:
        if columns * self._rows > MAX_CELLS:
            limit = f'so large that no more than {MAX_CELLS} cells are seen'
            raise ParameterError('object_size', limit, self._task.object_size)

    def _column_classes(self, starts: Integers, widths: Integers) -> Iterator[_ColumnClass]:
        """Yield the columns in classes of equal width and equal start modulo g."""
        alike = widths * self.pattern.stride + starts % self.pattern.stride
        order = np.argsort(alike, kind='stable')
        for columns in np.split(order, np.flatnonzero(np.diff(alike[order])) + 1):
            if len(columns):
                key = self._crossings(int(starts[columns[0]]), int(widths[columns[0]]))
                rows = np.arange(self._rows + 1) * self.pattern.period
                yield _ColumnClass(columns, starts[columns], key, np.searchsorted(key, rows))

    def _crossings(self, start: int, width: int) -> Integers:
        """Return the crossings of a column, as the key of a column class.

        They begin where the lidar enters the column in the row, or where the nod enters the row
        within the column.
        """
        pattern, row_of = self.pattern, self._row_of
        n_l, period = pattern.steps_per_revolution, pattern.period
        entered = np.arange(0, period, n_l)
        row = row_of[(start + entered) % pattern.cycle]
        always_inside = width == n_l
        by_column = (row * period + entered)[(row >= 0) & (not always_inside)]
        first = np.flatnonzero((row_of != np.roll(row_of, 1)) & (row_of >= 0))
        residue, offset = _pairs(first, start, width, pattern.stride, 0 if always_inside else 1)
        by_row = (
            row_of[residue] * period
            + self.pattern.whole_revolutions(residue - start - offset)
            + offset
        )
        return np.sort(np.concatenate([by_column, by_row]))

    def _first_hits_of(self, c: _ColumnClass, start: int) -> Integers:
        """Return the first hits in the columns of a class, shape (columns, rows)."""
        if len(c.key) == 0:
            return np.full((len(c.columns), self._rows), NEVER)
        period = self.pattern.period
        since = (
            self.pattern.whole_revolutions(c.starts - c.starts[0]) - c.starts + start
        ) % period
        order = np.argsort(since)
        wanted = np.arange(self._rows)[:, None] * period + since[order]
        found = np.searchsorted(c.key, wanted)
        next_period = found == c.bounds[1:, None]
        found = np.where(next_period, c.bounds[:-1, None], found)
        never = (c.bounds[:-1] == c.bounds[1:])[:, None]
        hit = c.key[np.minimum(found, len(c.key) - 1)] + period * next_period - wanted
        first = np.empty((len(order), self._rows), dtype=np.int64)
        first[order] = np.where(never, NEVER, hit).T
        return first


def column_runs(column_of_step: Integers) -> tuple[Integers, Integers]:
    """Return the first step and the number of steps of each column that is measured, in order."""
    begins = np.flatnonzero(column_of_step != np.roll(column_of_step, 1))
    if len(begins) == 0:
        begins = np.zeros(1, dtype=np.int64)
    widths = np.diff(begins, append=begins[0] + len(column_of_step))
    column = column_of_step[begins]
    order = np.argsort(column, kind='stable')
    order = order[column[order] >= 0]
    return begins[order], widths[order]


def _check(task: Task, pattern: Pattern) -> None:
    if pattern.steps_per_revolution != task.steps_per_revolution:
        limit = f"the task's {task.steps_per_revolution}"
        raise ParameterError('steps_per_revolution', limit, pattern.steps_per_revolution)
    if pattern.samples_per_sweep > MAX_SAMPLES_PER_SWEEP:
        limit = f'at most {MAX_SAMPLES_PER_SWEEP} for coverage'
        raise ParameterError('samples_per_sweep', limit, pattern.samples_per_sweep)


def _rows_of_residue(task: Task, pattern: Pattern, guard: float) -> tuple[Integers, int]:
    """Return the row of each residue modulo 2 N_s, and how many rows there are.

    With a guard, the row is -1 where the error of a turn can bring a sample into the next one.
    """
    height = pattern.height(np.arange(pattern.cycle))
    row = task.row_of_height(height, pattern.samples_per_sweep)
    if guard > 0.0:
        reach = turn_reach(guard, height / pattern.samples_per_sweep)
        below = task.row_of_height(height - reach, pattern.samples_per_sweep)
        above = task.row_of_height(height + reach, pattern.samples_per_sweep)
        row = np.where(below == above, row, -1)
    if task.rows <= pattern.cycle:
        return row, task.rows
    hit = np.unique(row[row >= 0])
    return np.where(row >= 0, np.searchsorted(hit, row), -1), len(hit)


def turn_reach(error: float, part: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much turns that are off by an error displace samples between them.

    It is the root mean square of what the turn before and the one after do.

    Parameters
    ----------
    error
        Standard deviation of the turns' instants, in samples.
    part
        Part of the sweep that lies between the samples and the turn before them, 0 .. 1.
    """
    return error * np.sqrt(part**2 + (1.0 - part) ** 2)


def _pairs(
    residues: Integers, start: int, width: int, stride: int, least: int
) -> tuple[Integers, Integers]:
    """Return the residues and offsets into a column, least to width - 1, that occur together."""
    offset = (residues - start) % stride + stride * np.arange(-(-width // stride))[:, None]
    residue = np.broadcast_to(residues, offset.shape)
    kept = (offset >= least) & (offset < width)
    return residue[kept], offset[kept]


def _longest_gaps(c: _ColumnClass, period: int) -> Integers:
    """Return the longest gap between crossings in each row that has any, period after period."""
    begins, ends = c.bounds[:-1], c.bounds[1:]
    begins, ends = begins[begins < ends], ends[begins < ends]
    if len(begins) == 0:
        return np.zeros(0, dtype=np.int64)
    gap = np.diff(c.key, append=0)
    gap[ends - 1] = c.key[begins] + period - c.key[ends - 1]
    return np.asarray(np.maximum.reduceat(gap, begins))
