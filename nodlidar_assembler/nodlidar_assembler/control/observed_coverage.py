"""Observed coverage: what the beams of the last seconds hit, updated scan by scan."""

from collections import deque
from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array, Integers, Mask, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.pattern.task import ON_THE_LINE, Task
import numpy as np

# Most cells of the finest grid, four bytes each.
MAX_FINEST_CELLS = 2**26


@dataclass(frozen=True, slots=True)
class Covered:
    """Observed coverage of a window of time.

    Attributes
    ----------
    until_ns
        End of the window: the instant of the last beam [ns]; None before the first one.
    beams
        Beams in the region.
    cells
        Number of cells in the region.
    seen
        Share of them that were hit.
    hole
        Side [rad] of the largest square of whole cells without a hit.
    repeats
        Share of the beams in a cell of the finest grid (azimuth step x rows of span / N_s) that
        an earlier beam has hit.
    least_repeats
        Share of the beams that are repeats with any nod: those in excess of the cells of the
        finest grid.
    """

    until_ns: int | None
    beams: int
    cells: int
    seen: float
    hole: float
    repeats: float
    least_repeats: float


class ObservedCoverage:
    """Cells that the beams of a sliding window hit.

    The cost of a scan is that of its beams and of those that leave the window, of any length.

    Parameters
    ----------
    task
        Region, lidar and cells.
    samples_per_sweep
        N_s: rows of the finest grid.
    window
        Length of the window [s].

    Raises
    ------
    ParameterError
        If the window is not positive and finite, or the finest grid would be too large.
    """

    def __init__(self, task: Task, samples_per_sweep: int, window: float) -> None:
        most = MAX_FINEST_CELLS // task.steps_per_revolution
        if not 1 <= samples_per_sweep <= most:
            raise ParameterError('samples_per_sweep', f'between 1 and {most}', samples_per_sweep)
        if not 0.0 < window < math.inf:
            raise ParameterError('window', 'above 0 s and finite', window)
        self.task = task
        self._samples_per_sweep = samples_per_sweep
        self._window_ns = round(window * NS_PER_S)
        self._column_of_step = task.column_of_step()
        self._cells = _CellCounts(task.cells)
        self._finest = _CellCounts(task.steps_per_revolution * samples_per_sweep)
        self._attainable = int((self._column_of_step >= 0).sum()) * samples_per_sweep
        # Times [ns], cells and finest cells of the beams in the window, shape (3, n) per scan.
        self._scans: deque[Integers] = deque()
        self._beams = 0
        self._last_ns: int | None = None

    def add(self, times_ns: Times, azimuth: Array, pitch: Array) -> None:
        """Add the beams of a scan, with or without a measurement; drop those that are too old.

        Beams outside the region do not count. The window ends with the last beam.

        Parameters
        ----------
        times_ns
            When each beam was sent [ns], ascending, shape (n,).
        azimuth, pitch
            Direction of each beam [rad], shape (n,).

        Raises
        ------
        ParameterError
            If the shapes differ, or the times do not ascend, from scan to scan too.
        """
        if not times_ns.shape == azimuth.shape == pitch.shape:
            shapes = azimuth.shape, pitch.shape
            raise ParameterError('times_ns', f'of the shapes {shapes}', times_ns.shape)
        if len(times_ns) == 0:
            return
        self._check_order(times_ns)
        beams = self._located(times_ns, azimuth, pitch)
        self._cells.add(beams[1])
        self._finest.add(beams[2])
        self._scans.append(beams)
        self._beams += beams.shape[1]
        self._last_ns = int(times_ns[-1])
        self._forget(self._last_ns - self._window_ns)

    @property
    def seen(self) -> float:
        """Share of the cells that were hit."""
        return self._cells.occupied / self.task.cells

    def covered(self) -> Covered:
        """Return the coverage of the window."""
        unseen = self._cells.counts.reshape(self.task.columns, self.task.rows) == 0
        hole = min(largest_square(unseen, self.task.full_circle) * self.task.cell, self._widest())
        beams = max(self._beams, 1)
        return Covered(
            until_ns=self._last_ns,
            beams=self._beams,
            cells=self.task.cells,
            seen=self.seen,
            hole=hole,
            repeats=(self._beams - self._finest.occupied) / beams,
            least_repeats=max(self._beams - self._attainable, 0) / beams,
        )

    def _widest(self) -> float:
        """Return the side of the widest square in the region [rad]; outer cells may be smaller."""
        wide = math.tau if self.task.full_circle else 2.0 * self.task.azimuth
        return min(wide, self.task.span)

    def _check_order(self, times_ns: Times) -> None:
        before = self._last_ns if self._last_ns is not None else int(times_ns[0])
        steps = np.diff(times_ns, prepend=before)
        if steps.min() < 0:
            late = int(np.argmin(steps))
            raise ParameterError('times_ns', 'ascending, from scan to scan', int(times_ns[late]))

    def _located(self, times_ns: Times, azimuth: Array, pitch: Array) -> Integers:
        """Return time [ns], cell and finest cell of the beams in the region, shape (3, n)."""
        task, n_s = self.task, self._samples_per_sweep
        step = task.step_at(azimuth)
        column = self._column_of_step[step]
        height = (pitch - task.pitch_min) / task.span * n_s
        slack = ON_THE_LINE * n_s
        inside = (column >= 0) & (height >= -slack) & (height <= n_s + slack)
        step, column, height = step[inside], column[inside], height[inside]
        row = task.row_of_height(height, n_s)
        finest_row = np.clip(np.floor(height + ON_THE_LINE).astype(np.int64), 0, n_s - 1)
        return np.stack([times_ns[inside], column * task.rows + row, step * n_s + finest_row])

    def _forget(self, before_ns: int) -> None:
        """Drop the beams up to an instant [ns]."""
        while self._scans:
            scan = self._scans[0]
            old = int(np.searchsorted(scan[0], before_ns, side='right'))
            self._cells.remove(scan[1, :old])
            self._finest.remove(scan[2, :old])
            self._beams -= old
            if old < scan.shape[1]:
                self._scans[0] = scan[:, old:]
                return
            self._scans.popleft()


class _CellCounts:
    """Counts the beams in every cell, and the cells that are not empty."""

    def __init__(self, cells: int) -> None:
        self.counts = np.zeros(cells, dtype=np.int32)
        self.occupied = 0

    def add(self, cells: Integers) -> None:
        cells, counts = np.unique(cells, return_counts=True)
        self.occupied += int(np.count_nonzero(self.counts[cells] == 0))
        self.counts[cells] += counts.astype(np.int32)

    def remove(self, cells: Integers) -> None:
        cells, counts = np.unique(cells, return_counts=True)
        self.counts[cells] -= counts.astype(np.int32)
        self.occupied -= int(np.count_nonzero(self.counts[cells] == 0))


def largest_square(free: Mask, around: bool = False) -> int:
    """Return the side of the largest square of cells that are all free.

    Parameters
    ----------
    free
        Whether each cell is free, shape (columns, rows).
    around
        Whether the first column adjoins the last one.
    """
    most = min(free.shape)
    if around:
        free = np.concatenate([free, free[: most - 1]])
    # Number of taken cells before each corner: four of these give the number in a square.
    taken = np.zeros((free.shape[0] + 1, free.shape[1] + 1), dtype=np.int64)
    taken[1:, 1:] = np.cumsum(np.cumsum(~free, axis=0), axis=1)
    least = 0
    while least < most:
        side = (least + most + 1) // 2
        within = (
            taken[side:, side:] - taken[:-side, side:] - taken[side:, :-side]
            + taken[:-side, :-side]
        )  # fmt: skip
        if (within == 0).any():
            least = side
        else:
            most = side - 1
    return least
