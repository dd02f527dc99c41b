"""The white noise of joint samples, apart from any motion."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEMORY = 0.99  # weight of a sample, over that of the next one
LAGS = 6
CLIPPED = 4.5  # medians; a larger third difference is a reversal
FREQUENCIES = np.linspace(np.pi / 2.0, np.pi, 9)  # per sample, which a nod hardly has

_TAPER = 1.0 - np.arange(LAGS + 1) / (LAGS + 1.0)
_COSINES = 2.0 * np.cos(np.outer(np.arange(LAGS + 1), FREQUENCIES)) * _TAPER[:, None]
_COSINES[0] = 1.0
# Autocovariance of the third difference of white noise of variance 1.
_OF_WHITE_NOISE = np.append([20.0, -15.0, 6.0, -1.0], np.zeros(LAGS - 3)) @ _COSINES
_LEAST_OF_NINE = 0.87  # least of the spectrum's values over their mean, for white noise


class WhiteNoise:
    """Estimates the variance of white noise in joint samples of any motion.

    The third difference leaves hardly anything of a nod, and white noise is as strong at every
    frequency, while vibrations are not. So the noise is the least of the spectrum of the third
    difference, over that of white noise of variance 1, in the upper half of the frequencies.
    """

    def __init__(self) -> None:
        self._covariance = np.zeros(LAGS + 1)
        self._count = 0.0

    def add(self, pitch: Array, new: slice) -> float:
        """Return the variance [rad2], with new samples of an array (n,) added; 0 without any."""
        difference = np.diff(pitch, 3)
        first, last = max(LAGS, new.start - 3), new.stop - 3
        if last > first:
            size = np.abs(difference)
            limit = CLIPPED * float(np.partition(size, len(size) // 2)[len(size) // 2])
            difference = np.clip(difference, -limit, limit)
            memory = MEMORY ** (last - first)
            self._count = memory * self._count + (last - first)
            self._covariance *= memory
            for lag in range(LAGS + 1):
                before = difference[first - lag : last - lag]
                self._covariance[lag] += difference[first:last] @ before
        if self._count == 0.0:
            return 0.0
        spectrum = self._covariance @ _COSINES / _OF_WHITE_NOISE
        return max(0.0, float(spectrum.min()) / self._count / _LEAST_OF_NINE)
