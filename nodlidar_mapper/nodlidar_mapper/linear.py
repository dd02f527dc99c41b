"""Small systems of equations.

numpy.linalg.solve and inv call a function that OpenBLAS spreads over threads whatever the size.
These then wait for more work for some 30 ms, and so keep every processor busy.
"""

from nodlidar_mapper.poses import Array
import numpy as np
from scipy.linalg import cho_factor, cho_solve


def solved(matrix: Array, right: Array) -> Array:
    """Return the solution of a positive definite system, shape (n,) or (n, k)."""
    return np.asarray(cho_solve(cho_factor(matrix), right))


def inverted(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix."""
    return solved(matrix, np.eye(len(matrix)))
