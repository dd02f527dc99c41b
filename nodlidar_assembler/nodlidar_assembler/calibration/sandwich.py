"""The covariance of an estimate whose residuals are alike in groups of two kinds.

Errors are alike within a scan and, by the encoder, within a nod angle: Cameron, Gelbach, Miller,
"Robust inference with multiway clustering", Journal of Business and Economic Statistics, 2011.
"""

from nodlidar_assembler.calibration.beam_model import Beam, Ends, Values
from nodlidar_assembler.calibration.plane_search import Labels
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]

PITCH_BIN = 0.02  # of nod angle in which errors of the encoder are alike [rad]


def groups(beams: Beam, ends: Ends, values: Values) -> list[Labels]:
    """Return the group of each beam by its scan, by nod angle and way, and by both."""
    position, _ = beams.track.at(beams.time + values.delay)
    bins = np.floor(position / PITCH_BIN).astype(np.int64)
    angle = _numbered(2 * bins + ends.upward)
    scan = _numbered(beams.scan)
    return [scan, angle, _numbered(scan * (int(angle.max()) + 1) + angle)]


def of_groups(scores: csr_array, group: Labels) -> Array:
    """Return the sum over the groups of the outer products of their scores (n, unknowns)."""
    count = len(group)
    sums = (csr_array((np.ones(count), (group, np.arange(count)))) @ scores).toarray()
    return np.asarray(sums.T @ sums)


def standard_errors(curvature: Array, spreads: list[Array]) -> Array:
    """Return the largest standard errors by several spreads of the scores.

    The covariance is a spread between inverses of the curvature. That of groups of either kind
    may be negative by chance; it is at least that of each kind.
    """
    scale = 1.0 / np.sqrt(np.diag(curvature))
    outer = np.outer(scale, scale)
    inverse = np.linalg.inv(curvature * outer) * outer
    variances = [np.einsum('ij,jk,ki->i', inverse, spread, inverse) for spread in spreads]
    return np.asarray(np.sqrt(np.max(variances, axis=0)))


def _numbered(group: Labels) -> Labels:
    return np.unique(group, return_inverse=True)[1].astype(np.int64)
