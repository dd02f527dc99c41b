"""How a scan pattern covers the cells of a task: exact, without visiting every sample."""

from dataclasses import dataclass

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.coverage.crossings import column_classes, NEVER
from nodlidar_planner.pattern.pattern import MAX_SAMPLES_PER_SWEEP, Pattern
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np

MAX_CELLS = 20_000_000  # for memory


@dataclass(frozen=True, slots=True)
class Figures:
    """Pattern coverage of the cells of a task, over the pattern's whole period.

    Attributes
    ----------
    completion_time
        Time until every cell has been hit once [s]; infinite if some cell never is.
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


class Coverage:
    """The coverage of a task's cells by a pattern.

    A sample hits a cell if its step is in the cell's column and its pitch in the cell's row.
    Consecutive samples in one cell are one crossing, at the instant of the first.

    Parameters
    ----------
    task
        Region, cells and lidar.
    pattern
        Of the same N_L.
    margin
        Error of the reversals [samples]. A sample nearer to the next row than `reversal_reach` of
        it does not count as a hit.

    Raises
    ------
    ParameterError
        If the N_L differ, a column is on both sides of a gap in the lidar's window, or N_s or the
        number of cells exceeds the bound on memory.
    """

    def __init__(self, task: Task, pattern: Pattern, margin: float = 0.0) -> None:
        _check(task, pattern)
        self._task = task
        self.pattern = pattern
        self._column_of = task.column_of_step()
        self._row_of, self._rows = _rows_of_residue(task, pattern, margin)
        starts, widths = column_runs(self._column_of)
        if len(np.unique(self._column_of[starts])) < len(starts):
            limit = 'such that no column is on both sides of a gap in the window of the lidar'
            raise ParameterError('azimuth', limit, task.azimuth)
        self._check_memory(min(len(starts), 2 * pattern.stride))
        self._seen = self._column_of[starts]
        self._classes = list(column_classes(pattern, self._row_of, self._rows, starts, widths))
        self._never_left = (
            len(widths) == 1
            and widths[0] == len(self._column_of)
            and (bool(np.all(self._row_of == 0)))
        )

    def first_hits(self, start: int = 0) -> Integers:
        """Return the number of samples from a starting sample to the next hit of each cell.

        To start at another sample is to start the nod at another pitch (docs/model.md).

        Returns
        -------
        Shape (measured columns, rows that are hit, from below); NEVER for a cell never hit.
        """
        self._check_memory(len(self._seen))
        first = np.full((len(self._seen), self._rows), NEVER)
        for column_class in self._classes:
            first[column_class.columns] = column_class.first_hits(start)
        step, residue = start % len(self._column_of), start % len(self._row_of)
        if self._column_of[step] >= 0 and self._row_of[residue] >= 0:
            column = np.searchsorted(self._seen, self._column_of[step])
            first[column, self._row_of[residue]] = 0
        return first

    def completion_time(self, start: int = 0) -> float:
        """Return the time from a sample until every cell has been hit [s], infinite if never."""
        if self.never_hit_share() > 0.0:
            return np.inf
        return float(self.first_hits(start).max()) * self._task.beam_period

    def never_hit_share(self) -> float:
        """Return the share of all cells that are never hit."""
        hit = int(self._never_left)
        for c in self._classes:
            hit += np.count_nonzero(np.diff(c.bounds)) * len(c.columns)
        return float(1.0 - hit / self._task.cells) if hit < self._task.cells else 0.0

    def figures(self) -> Figures:
        """Return the figures of the whole period; completion counts from sample 0."""
        share = self.never_hit_share()
        period = self.pattern.period
        longest, crossings, sum_of_longest = 0, 0, 0
        for c in self._classes:
            gaps = c.longest_gaps()
            longest = max(longest, int(gaps.max(initial=0)))
            sum_of_longest += int(gaps.sum()) * len(c.columns)
            crossings += len(c.key) * len(c.columns)
        if self._never_left:
            crossings = 1
        time = self._task.beam_period
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


def _check(task: Task, pattern: Pattern) -> None:
    if pattern.steps_per_revolution != task.steps_per_revolution:
        limit = f"the task's {task.steps_per_revolution}"
        raise ParameterError('steps_per_revolution', limit, pattern.steps_per_revolution)
    if pattern.samples_per_sweep > MAX_SAMPLES_PER_SWEEP:
        limit = f'at most {MAX_SAMPLES_PER_SWEEP} for coverage'
        raise ParameterError('samples_per_sweep', limit, pattern.samples_per_sweep)


def _rows_of_residue(task: Task, pattern: Pattern, margin: float) -> tuple[Integers, int]:
    """Return the row of each residue modulo 2 N_s, and the number of rows.

    With a margin, the row is -1 where the error of a reversal can move a sample into another row.
    """
    height = pattern.height(np.arange(pattern.cycle))
    row = task.row_of_height(height, pattern.samples_per_sweep)
    if margin > 0.0:
        reach = reversal_reach(margin, height / pattern.samples_per_sweep)
        below = task.row_of_height(height - reach, pattern.samples_per_sweep)
        above = task.row_of_height(height + reach, pattern.samples_per_sweep)
        row = np.where(below == above, row, -1)
    if task.rows <= pattern.cycle:
        return row, task.rows
    hit = np.unique(row[row >= 0])
    return np.where(row >= 0, np.searchsorted(hit, row), -1), len(hit)


def reversal_reach(error: float, part: Array) -> Array:
    """Return by how much errors of the reversals displace the samples between them.

    It is the root mean square of the effects of the reversals before and after.

    Parameters
    ----------
    error
        Standard deviation of the reversal instants [samples].
    part
        Fraction of the sweep from the reversal before to the samples, 0 .. 1.
    """
    return error * np.sqrt(part**2 + (1.0 - part) ** 2)
