"""The covariance of an estimate whose residuals are alike in groups, as those of a scan are.

Liang, Zeger, "Longitudinal data analysis using generalized linear models", Biometrika, 1986.
"""

from nodlidar_assembler.calibration.plane_search import Labels
from nodlidar_common.arrays import Array
import numpy as np
from scipy.sparse import csr_array


def spread_of(scores: Array, group: Labels) -> Array:
    """Return the spread of scores (n, unknowns) that are alike in groups (n,)."""
    count = len(group)
    sums = csr_array((np.ones(count), (group, np.arange(count)))) @ scores
    return np.asarray(sums.T @ sums)


def standard_errors(curvature: Array, spread: Array) -> Array:
    """Return the standard errors; the covariance is the spread between inverse curvatures."""
    inverse = inverse_of(curvature)
    return np.asarray(np.sqrt(np.einsum('ij,jk,ki->i', inverse, spread, inverse)))


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix whose rows have different units."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    outer: Array = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * outer) * outer)
