"""The relief of surfaces: panels, frames and carpets stand out of a wall or floor by some mm.

The offset of a patch from its plane is an effect that is not known, with a spread that is learned
from most patches: Laird, Ware, "Random-effects models for longitudinal data", Biometrics, 1982.
Without it, the noise of thousands of beams seems to prove that a wall with a panel is curved, and
the calibration bends what it can to that. Patches that are far off do not count.
"""

from dataclasses import dataclass

from nodlidar_assembler.calibration.plane_search import Labels
from nodlidar_common.arrays import Array
import numpy as np
from scipy.sparse import csr_array

FLAT = 1e-3  # spread of the patches of a flat surface [m]
REDESCENDING = 2.0  # standard deviations; Tukey's biweight ignores patches that are farther off
LEAST_KNOWN = 0.1  # of the median information of a patch, for one from which the spread is learned


@dataclass(frozen=True, slots=True)
class Relief:
    """The relief that residuals show.

    Attributes
    ----------
    patch
        Of each beam, shape (n,).
    variance
        Of the offsets of most patches [m^2].
    counts
        By how much each beam counts for its patch, from 0 to 1, shape (n,).
    """

    patch: Labels
    variance: float
    counts: Array

    @classmethod
    def of(cls, residual: Array, weight: Array, patch: Labels) -> 'Relief':
        """Return the relief that residuals (n,) [m] with weights [1/m^2] show, given patches."""
        known = np.maximum(np.bincount(patch, weight), np.finfo(np.float64).tiny)
        mean = np.bincount(patch, weight * residual) / known
        used = known > LEAST_KNOWN * np.median(known)
        square = (float(np.median(np.abs(mean[used]))) / 0.6745) ** 2
        variance = max(FLAT**2, square - float(np.median(1.0 / known[used])))
        far = np.minimum(mean**2 / (variance + 1.0 / known) / REDESCENDING**2, 1.0)
        return cls(patch, variance, ((1.0 - far) ** 2)[patch])

    def normal(self, slopes: Array, weight: Array) -> Array:
        """Return the normal matrix of derivatives (n, unknowns) with weights (n,)."""
        weighted = slopes * weight[:, None]
        count = len(self.patch)
        members = csr_array((np.ones(count), (self.patch, np.arange(count))))
        sums = members @ weighted
        shares = sums / self._information(weight)[:, None]
        return np.asarray(weighted.T @ slopes - sums.T @ shares)

    def without(self, residual: Array, weight: Array) -> Array:
        """Return residuals [m] less the offsets of their patches, shape (n,)."""
        offset = np.bincount(self.patch, weight * residual) / self._information(weight)
        return np.asarray(residual - offset[self.patch])

    def _information(self, weight: Array) -> Array:
        """Return that of the offset of each patch; no less than before the beams."""
        return 1.0 / self.variance + np.maximum(np.bincount(self.patch, weight), 0.0)
