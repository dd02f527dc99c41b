"""Plain enumeration of a pattern, sample by sample: what the planner is checked with."""

from dataclasses import dataclass

from nodlidar_assembler.planner.coverage import NEVER
import numpy as np


@dataclass(frozen=True)
class Enumerated:
    """First hits, longest gaps and crossings in one period of every cell, (columns, rows)."""

    first: np.ndarray
    longest_gap: np.ndarray
    crossings: np.ndarray


def cells_of_samples(task, pattern, n):
    """Return column * rows + row of each sample; -1 where it is in no cell."""
    column = task.column_of_step()[n % pattern.steps_per_revolution]
    wave = (n + pattern.phase) % (2 * pattern.samples_per_sweep)
    triangle = pattern.samples_per_sweep - np.abs(wave - pattern.samples_per_sweep)
    height = triangle * (task.span / pattern.samples_per_sweep)
    row = np.minimum(np.floor(height / task.cell + 1e-9).astype(np.int64), task.rows - 1)
    return np.where(column >= 0, column * task.rows + row, -1)


def enumerate_cells(task, pattern):
    """Enumerate one period."""
    cells = task.columns * task.rows
    period = np.lcm(pattern.steps_per_revolution, 2 * pattern.samples_per_sweep)
    cell = cells_of_samples(task, pattern, np.arange(period, dtype=np.int64))
    first = np.full(cells, NEVER)
    hits = np.flatnonzero(cell >= 0)
    first[cell[hits][::-1]] = hits[::-1]
    begins = np.flatnonzero((cell != np.roll(cell, 1)) & (cell >= 0))
    if len(begins) == 0 and cell[0] >= 0:  # all samples are in one cell, which is never left
        return _shaped(task, first, np.zeros(cells, int), np.bincount(cell[:1], minlength=cells))
    begins = begins[np.argsort(cell[begins], kind='stable')]
    gap = (np.roll(begins, -1) - begins).astype(np.int64)
    last = np.flatnonzero(np.diff(cell[begins], append=-1))
    starts = np.concatenate([[0], last[:-1] + 1]) if len(last) else last
    gap[last] = begins[starts] + period - begins[last]
    longest = np.zeros(cells, dtype=np.int64)
    np.maximum.at(longest, cell[begins], gap)
    return _shaped(task, first, longest, np.bincount(cell[begins], minlength=cells))


def _shaped(task, *figures):
    return Enumerated(*(figure.reshape(task.columns, task.rows) for figure in figures))
