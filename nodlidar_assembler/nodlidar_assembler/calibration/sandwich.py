"""The covariance of an estimate whose residuals are alike in groups of two kinds.

Errors are alike within a scan, by the joint samples, and within a patch of a surface, by its
material and shape: Liang, Zeger, "Longitudinal data analysis using generalized linear models",
Biometrika, 1986.
"""

from nodlidar_assembler.calibration.beam_model import Beam, Ends
from nodlidar_assembler.calibration.plane_search import Labels, patches
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]

PATCH = 0.4  # edge of the cubes in which errors of a surface are alike [m]


def spreads_of(scores: csr_array, beams: Beam, ends: Ends) -> list[Array]:
    """Return the spreads of the beams' scores (n, unknowns), by scan and by patch of surface."""
    return [_spread(scores, group) for group in (beams.scan, patches(ends.xyz, PATCH))]


def _spread(scores: csr_array, group: Labels) -> Array:
    """Return the sum over the groups of the outer products of their scores."""
    count = len(group)
    sums = (csr_array((np.ones(count), (group, np.arange(count)))) @ scores).toarray()
    return np.asarray(sums.T @ sums)


def standard_errors(curvature: Array, spreads: list[Array]) -> Array:
    """Return the largest standard errors by several spreads of the scores.

    The covariance is a spread between inverses of the curvature.
    """
    inverse = inverse_of(curvature)
    variances = [np.einsum('ij,jk,ki->i', inverse, spread, inverse) for spread in spreads]
    return np.asarray(np.sqrt(np.max(variances, axis=0)))


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix whose rows have different units."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    outer: Array = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * outer) * outer)
