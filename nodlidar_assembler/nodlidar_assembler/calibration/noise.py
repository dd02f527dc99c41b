"""The noise of residuals, learned from them."""

from nodlidar_common.arrays import Array
import numpy as np
from scipy.optimize import nnls

_LEAST = 1e-6  # variance [m^2]


def noise_variance(residual: Array, cosine: Array, ranges: Array) -> Array:
    """Return the variance of each residual [m^2]: a constant, and two that the range causes."""
    clipped = np.minimum(np.abs(residual), 3.0 * np.median(np.abs(residual)) / 0.6745)
    terms = np.stack(
        [np.ones_like(residual), cosine**2, (cosine * ranges) ** 2, ranges**2], axis=1
    )
    found, _ = nnls(terms[::7], clipped[::7] ** 2)
    return np.asarray(np.maximum(terms @ found, _LEAST))
