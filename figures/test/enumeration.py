"""The nodding lidar counted sample by sample, in integers, without the code of the packages."""

from itertools import accumulate

import numpy as np

N_L = 1024


def directions(steps, sweeps, phase=(1, 2)):
    """Return azimuth step and height of each sample of a nod whose speed changes at reversals.

    Parameters
    ----------
    steps
        N_L.
    sweeps
        Pairs of N_s and a number of samples, one after the other. Each begins a phase after the
        nod was at its lower limit, going up.
    phase
        Numerator and denominator [samples].

    Returns
    -------
    pairs
        Step, and height as a numerator over ``denominator(sweeps, phase)``, shape (n, 2).
    """
    whole = denominator(sweeps, phase)
    begins = [0, *accumulate(count for _, count in sweeps)]
    pairs = []
    for (n_s, count), begin in zip(sweeps, begins, strict=False):
        parts = np.arange(count, dtype=np.int64) * phase[1] + phase[0]  # of a sample
        turn = 2 * n_s * phase[1]
        height = np.minimum(parts % turn, turn - parts % turn) * (whole // (n_s * phase[1]))
        pairs.append(np.stack([(begin + np.arange(count)) % steps, height], axis=1))
    return np.concatenate(pairs)


def denominator(sweeps, phase=(1, 2)):
    """Return the number of equal parts of the span in which every height is whole."""
    return int(np.prod([n_s for n_s, _ in sweeps], dtype=object)) * phase[1]


def distinct(pairs):
    """Return the number of distinct pairs of integers (n, 2)."""
    numbers = pairs[:, 0] * (pairs[:, 1].max() + 1) + pairs[:, 1]
    if numbers.max() > 8 * len(numbers):
        return len(np.unique(numbers))
    seen = np.zeros(numbers.max() + 1, dtype=bool)
    seen[numbers] = True
    return np.count_nonzero(seen)


def hit_cells(n_s, count, columns, rows, cell, span):
    """Return whether each cell of a full circle is hit by the first samples, shape (cells,)."""
    return np.bincount(_cells(n_s, count, rows, cell, span), minlength=columns * rows) > 0


def completion(n_s, columns, rows, cell, span, phase=(1, 2)):
    """Return the index of the sample by which every cell of a full circle has been hit."""
    count = 4 * N_L
    while True:
        cells = _cells(n_s, count, rows, cell, span, phase)
        seen, first = np.unique(cells, return_index=True)
        if len(seen) == columns * rows:
            return int(first.max())
        count *= 2


def crossings(n_s, columns, rows, cell, span):
    """Return the number of crossings of all cells in one period of an odd N_s."""
    cells = _cells(n_s, n_s * N_L, rows, cell, span)
    return int(np.count_nonzero(cells != np.roll(cells, 1)))


def longest_gaps(n_s, rows, cell, span, phase):
    """Return the longest time between two hits of each cell that is hit [samples], (cells,).

    All samples of a period are walked. A gap goes from the last sample in a cell before others to
    the next one in it.
    """
    period = n_s * N_L
    cells = _cells(n_s, period, rows, cell, span, phase)
    order = np.argsort(cells, kind='stable')
    begin = np.flatnonzero(np.diff(cells[order], prepend=-1))
    after = np.append(order[1:], 0)
    end = np.append(begin[1:], len(order)) - 1
    after[end] = order[begin] + period
    return np.maximum.reduceat(after - order, begin)


def repeats_by_height(n_s, speed, acceleration, beam_period):
    """Return the share of beams that repeat in each hundredth of the span, and the beams there.

    The nod reverses in parabolas and is sampled for n_s revolutions, from half a sample past its
    lower limit. A beam repeats an earlier one of its step in the same n_s-th of the span.
    """
    beam = np.arange(n_s * N_L)
    place = (beam + 0.5) % (2 * n_s)
    since = np.abs((place + n_s / 2) % n_s - n_s / 2) * beam_period  # of the nearest reversal
    half = speed / acceleration
    rise = np.where(since < half, speed * (half / 2.0 + since**2 / (2.0 * half)), speed * since)
    span = speed * n_s * beam_period
    down = (place > n_s / 2) & (place < 3 * n_s / 2)  # nearer to the upper limit
    height = np.where(down, span - rise, rise) / span
    cell = np.floor(height * n_s).astype(np.int64) * N_L + beam % N_L
    earliest = np.empty(cell.max() + 1, dtype=np.int64)
    earliest[cell[::-1]] = beam[::-1]  # of beams in one cell, the last that is written stays
    first = earliest[cell] == beam
    part = np.floor(height * 100).astype(np.int64)
    beams = np.bincount(part, minlength=100)
    return np.bincount(part[~first], minlength=100) / np.maximum(beams, 1), beams


def _cells(n_s, count, rows, cell, span, phase=(1, 2)):
    """Return the cell of each sample: steps repeat by the revolution, heights by two sweeps."""
    step = directions(N_L, [(n_s, N_L)], phase)[:, 0]
    height = directions(N_L, [(n_s, 2 * n_s)], phase)[:, 1]
    column = np.floor(step * (2.0 * np.pi / N_L / cell) + 1e-9).astype(np.int64)
    row = np.floor(height * (span / (phase[1] * n_s) / cell) + 1e-9).astype(np.int64)
    return np.resize(column * rows, count) + np.resize(np.minimum(row, rows - 1), count)
