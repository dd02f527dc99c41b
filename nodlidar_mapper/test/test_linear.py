"""Systems of equations."""

from nodlidar_mapper.geometry.linear import solved_each
import numpy as np


def test_each_system_is_solved():
    rng = np.random.default_rng(1)
    factors, wanted = rng.normal(size=(50, 4, 6)), rng.normal(size=(50, 4, 2))
    matrices = factors @ np.swapaxes(factors, 1, 2)
    np.testing.assert_allclose(solved_each(matrices, matrices @ wanted), wanted, atol=1e-6)
    assert solved_each(matrices[:0], wanted[:0]).shape == (0, 4, 2)
