"""The covariance of an estimate whose residuals are alike in groups of several kinds.

Errors are alike within a scan, by the encoder within a nod angle, and by the surface within a
patch of it: Cameron, Gelbach, Miller,
"Robust inference with multiway clustering", Journal of Business and Economic Statistics, 2011.
"""

from nodlidar_assembler.calibration.beam_model import Beam, Ends, Values
from nodlidar_assembler.calibration.plane_search import Labels, patches
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]

PATCH = 0.4  # edge of the cubes in which errors of a surface are alike [m]
PITCH_BIN = 0.02  # of nod angle in which errors of the encoder are alike [rad]


def spreads_of(scores: csr_array, beams: Beam, ends: Ends, values: Values) -> list[Array]:
    """Return the spreads of the beams' scores (n, unknowns), by groups of several kinds.

    By scan, by nod angle and way, by patch of surface, by scan or angle, and by scan or patch.
    """
    position, _ = beams.track.at(beams.time + values.delay)
    angle = 2 * np.floor(position / PITCH_BIN).astype(np.int64) + ends.upward
    scan = _numbered(beams.scan)
    by_scan = _spread(scores, scan)
    spreads = [by_scan]
    for group in (_numbered(angle), _numbered(patches(ends.xyz, PATCH))):
        both = _numbered(scan * (int(group.max()) + 1) + group)
        one = _spread(scores, group)
        spreads += [one, by_scan + one - _spread(scores, both)]
    return spreads


def _spread(scores: csr_array, group: Labels) -> Array:
    """Return the sum over the groups of the outer products of their scores."""
    count = len(group)
    sums = (csr_array((np.ones(count), (group, np.arange(count)))) @ scores).toarray()
    return np.asarray(sums.T @ sums)


def standard_errors(curvature: Array, spreads: list[Array]) -> Array:
    """Return the largest standard errors by several spreads of the scores.

    The covariance is a spread between inverses of the curvature. That of groups of either kind
    may be negative by chance; it is at least that of each kind.
    """
    inverse = inverse_of(curvature)
    variances = [np.einsum('ij,jk,ki->i', inverse, spread, inverse) for spread in spreads]
    return np.asarray(np.sqrt(np.max(variances, axis=0)))


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix whose rows have different units."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    outer: Array = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * outer) * outer)


def _numbered(group: Labels) -> Labels:
    return np.unique(group, return_inverse=True)[1].astype(np.int64)
