"""Small systems of equations.

numpy.linalg.solve and inv call a function that OpenBLAS spreads over threads whatever the size.
These then wait for more work for some 30 ms, and so keep every processor busy. So do products of
a large matrix: einsum stands for those elsewhere.
"""

from nodlidar_common.arrays import Array
import numpy as np
from scipy.linalg import cho_factor, cho_solve


def solved(matrix: Array, right: Array) -> Array:
    """Return the solution of a positive definite system, shape (n,) or (n, k)."""
    return np.asarray(cho_solve(cho_factor(matrix), right))


def inverted(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix."""
    return solved(matrix, np.eye(len(matrix)))


def solved_each(matrices: Array, right: Array) -> Array:
    """Return the solutions of many positive definite systems (n, k, k), shape (n, k, m).

    Gauss-Jordan elimination, a row of all systems at a time.
    """
    rows = np.ascontiguousarray(np.moveaxis(np.concatenate([matrices, right], axis=2), 0, 2))
    for k in range(len(rows)):
        rows[k] /= rows[k, k]
        others = rows[:, k].copy()
        others[k] = 0.0
        rows -= others[:, None] * rows[k]
    return np.moveaxis(rows[:, len(rows) :], 2, 0)
