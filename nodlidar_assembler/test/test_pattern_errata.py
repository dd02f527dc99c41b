"""The counts that docs/model.md states for the pattern, by enumeration of the first nod."""

import math

from nodlidar_assembler.geometry import ScanGeometry
from nodlidar_assembler.nod_start import first_nod
import numpy as np
import pytest


def cells(n_l, n_s, phase):
    """Return how many directions the samples of N_s revolutions have, exact in integers."""
    n = np.arange(n_l * n_s, dtype=np.int64)
    quarters = 4 * n_s - np.abs((4 * n + round(4 * phase)) % (8 * n_s) - 4 * n_s)
    return np.unique(np.stack([n % n_l, quarters]), axis=1).shape[1]


@pytest.mark.parametrize(('n_l', 'n_s'), [(8, 5), (16, 7), (64, 21), (1024, 101), (1024, 1001)])
def test_only_half_of_the_samples_are_distinct_without_a_phase(n_l, n_s):
    assert cells(n_l, n_s, 0.0) == (n_s * n_l + n_l) // 2
    assert cells(n_l, n_s, 0.5) == n_s * n_l
    assert cells(n_l, n_s, 0.25) == n_s * n_l


def test_half_a_sample_of_phase_fills_every_cell_of_the_finest_grid_once():
    n_l, n_s = 64, 21
    geometry = ScanGeometry(n_l, -math.pi, 2 * math.pi / n_l, 0.1 / n_l, 0.02, 5.6)
    nod = first_nod(geometry, 0, n_l, -0.5, 0.5, n_s)
    n = np.arange(n_l * n_s)
    pitch = nod.pitch(np.rint(n * 0.1 / n_l * 1e9).astype(np.int64))
    rows = np.floor((pitch + 0.5) * n_s).astype(int)
    count = np.zeros((n_l, n_s), dtype=int)
    np.add.at(count, (n % n_l, rows), 1)
    assert np.array_equal(count, np.ones((n_l, n_s)))
