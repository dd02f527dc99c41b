"""Table I by the publication's own definition of a repeat: an azimuth, and 0.005 rad of pitch.

A bin is one azimuth step by 0.005 rad of pitch. Over N_s revolutions without error, at half a
sample of phase, the table gives the hits of a bin, which are N_s / 245 whatever the parity, and
the share of the beams in a bin that an earlier beam has hit. Dark beams count.
"""

import math

from nodlidar_common.arrays import Integers
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np

from bench.shared.reference import SPAN
from bench.shared.report import Row

TITLE = "Table I by the publication's definition: bins of one azimuth step by 0.005 rad"
PITCH_STEP = 0.005
N_L = 1024
# Even and odd N_s of Table I.
PAIRS = ((3000, 3009), (4000, 4009), (5000, 5009), (6000, 6009), (7000, 7009))


def results() -> list[Row]:
    """Return hits of a bin, shares of repeats and of empty bins, a row for each pair of N_s."""
    return [_row(*pair) for pair in PAIRS]


def hits_of_bins(samples_per_sweep: int) -> Integers:
    """Return the hits of each bin, shape (N_L, bins); the last bin is lower than the others."""
    bins = math.ceil(SPAN / PITCH_STEP)
    pattern = Pattern(N_L, samples_per_sweep)
    n = np.arange(samples_per_sweep * N_L)
    row = (pattern.height(n) * (SPAN / samples_per_sweep / PITCH_STEP)).astype(np.int64)
    found = np.bincount(pattern.step(n) * bins + row, minlength=N_L * bins)
    return found.reshape(N_L, bins)


def _row(even: int, odd: int) -> Row:
    by_parity = {n_s: hits_of_bins(n_s) for n_s in (even, odd)}
    repeats = {n: 1.0 - np.count_nonzero(hits) / hits.sum() for n, hits in by_parity.items()}
    empty = {n: float(np.mean(hits == 0)) for n, hits in by_parity.items()}
    return {
        'N_s': f'{even}, {odd}',
        'hits of a bin': even * PITCH_STEP / SPAN,
        'repeats, even N_s': float(repeats[even]),
        'repeats, odd N_s': float(repeats[odd]),
        'ratio': float(repeats[odd] / repeats[even]),
        'bins never hit, even N_s': empty[even],
        'bins never hit, odd N_s': empty[odd],
    }
