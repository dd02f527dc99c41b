"""When the lidar and the nod cross the cells of a task, without visiting every sample.

Sample n has azimuth step n mod N_L and residue n mod 2 N_s, which determines its row. A column is
a run of steps. From revolution to revolution, the residue at which the lidar enters it advances by
N_L modulo 2 N_s. With g = gcd(N_L, 2 N_s), columns of equal width whose first steps are equal
modulo g are crossed alike, some revolutions apart. So there are few classes of columns, and the
sorted crossings of one column per class determine those of all cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from nodlidar_common.arrays import Integers
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np

# Stands for the first hit of a cell that is never hit.
NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class ColumnClass:
    """Columns that are crossed alike.

    Attributes
    ----------
    pattern
        Of lidar and nod.
    columns, starts
        Their numbers among the measured columns, and their first steps; shape (c,).
    key
        The crossings of the first of them in one period, ascending, shape (k,): row * period + the
        first sample of the crossing, counted from the column's first step in revolution 0.
    bounds
        Index in the key at which each row begins, and the end of the last; shape (rows + 1,).
    """

    pattern: Pattern
    columns: Integers
    starts: Integers
    key: Integers
    bounds: Integers

    def first_hits(self, start: int) -> Integers:
        """Return the number of samples from a starting sample to the next crossing of each cell.

        Returns
        -------
        Shape (columns, rows); NEVER for a cell without crossings.
        """
        rows, period = len(self.bounds) - 1, self.pattern.period
        if len(self.key) == 0:
            return np.full((len(self.columns), rows), NEVER)
        ahead = self.pattern.whole_revolutions(self.starts - self.starts[0])
        since = (ahead - self.starts + start) % period
        order = np.argsort(since)
        wanted = np.arange(rows)[:, None] * period + since[order]
        found = np.searchsorted(self.key, wanted)
        next_period = found == self.bounds[1:, None]
        found = np.where(next_period, self.bounds[:-1, None], found)
        never = (self.bounds[:-1] == self.bounds[1:])[:, None]
        hit = self.key[np.minimum(found, len(self.key) - 1)] + period * next_period - wanted
        first = np.empty((len(order), rows), dtype=np.int64)
        first[order] = np.where(never, NEVER, hit).T
        return first

    def longest_gaps(self) -> Integers:
        """Return the longest gap between crossings [samples] of each row that has any, (rows,)."""
        begins, ends = self.bounds[:-1], self.bounds[1:]
        begins, ends = begins[begins < ends], ends[begins < ends]
        if len(begins) == 0:
            return np.zeros(0, dtype=np.int64)
        gap = np.diff(self.key, append=0)
        gap[ends - 1] = self.key[begins] + self.pattern.period - self.key[ends - 1]
        return np.asarray(np.maximum.reduceat(gap, begins))


def column_classes(
    pattern: Pattern, row_of: Integers, rows: int, starts: Integers, widths: Integers
) -> Iterator[ColumnClass]:
    """Yield the columns in classes of equal width and equal start modulo g.

    Parameters
    ----------
    pattern
        Of lidar and nod.
    row_of, rows
        The row of each residue modulo 2 N_s, shape (2 N_s,), -1 for none; the number of rows.
    starts, widths
        First step and number of steps of each column, shape (columns,).
    """
    alike = widths * pattern.stride + starts % pattern.stride
    order = np.argsort(alike, kind='stable')
    row_keys = np.arange(rows + 1) * pattern.period
    for columns in np.split(order, np.flatnonzero(np.diff(alike[order])) + 1):
        if len(columns):
            key = _crossings(pattern, row_of, int(starts[columns[0]]), int(widths[columns[0]]))
            bounds = np.searchsorted(key, row_keys)
            yield ColumnClass(pattern, columns, starts[columns], key, bounds)


def _crossings(pattern: Pattern, row_of: Integers, start: int, width: int) -> Integers:
    """Return the crossings of a column, as the key of a column class.

    A crossing begins when the lidar enters the column within the row, or when the nod enters the
    row within the column.
    """
    n_l, period = pattern.steps_per_revolution, pattern.period
    entered = np.arange(0, period, n_l)
    row = row_of[(start + entered) % pattern.cycle]
    always_inside = width == n_l
    by_column = (row * period + entered)[(row >= 0) & (not always_inside)]
    first = np.flatnonzero((row_of != np.roll(row_of, 1)) & (row_of >= 0))
    residue, offset = _pairs(first, start, width, pattern.stride, 0 if always_inside else 1)
    revolutions = pattern.whole_revolutions(residue - start - offset)
    by_row = row_of[residue] * period + revolutions + offset
    keys = np.concatenate([by_column, by_row])
    return np.sort(keys, kind='stable')  # quicker, since much is in order


def _pairs(
    residues: Integers, start: int, width: int, stride: int, least: int
) -> tuple[Integers, Integers]:
    """Return the residues and offsets into a column, least to width - 1, that occur together."""
    offset = (residues - start) % stride + stride * np.arange(-(-width // stride))[:, None]
    residue = np.broadcast_to(residues, offset.shape)
    kept = (offset >= least) & (offset < width)
    return residue[kept], offset[kept]
