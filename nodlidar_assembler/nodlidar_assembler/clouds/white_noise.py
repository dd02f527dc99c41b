"""The white noise of joint samples, apart from any motion."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEMORY = 0.99  # weight of a sample, over that of the next one
LAGS = 16  # with fewer, a vibration spreads over the frequencies beside its own
CLIPPED = 4.5  # medians; a larger third difference is a reversal
FREQUENCIES = np.linspace(np.pi / 2.0, np.pi, 17)  # per sample, which a nod hardly has

_SHARE = np.arange(LAGS + 1) / (LAGS + 1.0)
_TAPER = np.minimum(1.0 - 6.0 * _SHARE**2 * (1.0 - _SHARE), 2.0 * (1.0 - _SHARE) ** 3)  # Parzen's
_COSINES = 2.0 * np.cos(np.outer(np.arange(LAGS + 1), FREQUENCIES)) * _TAPER[:, None]
_COSINES[0] = 1.0
# Autocovariance of the third difference of white noise of variance 1.
_OF_WHITE_NOISE = np.append([20.0, -15.0, 6.0, -1.0], np.zeros(LAGS - 3)) @ _COSINES
_LEAST = 0.75  # of the spectrum's values over their mean, for white noise; found by simulation


class WhiteNoise:
    """Estimates the variance of white noise in joint samples of any motion.

    The third difference leaves hardly anything of a nod, and white noise is as strong at every
    frequency, while vibrations are not. So the noise is the least of the spectrum of the third
    difference, over that of white noise of variance 1, in the upper half of the frequencies
    (Blackman and Tukey 1958: the spectrum from the autocovariance).
    """

    def __init__(self) -> None:
        self._products = np.zeros(LAGS + 1)
        self._count = np.zeros(LAGS + 1)

    def add(self, pitch: Array) -> float:
        """Return the variance [rad2] with samples (n,) added; 0 without any."""
        difference = np.diff(pitch, 3)
        count = len(difference)
        if count:
            size = np.abs(difference)
            limit = CLIPPED * float(np.partition(size, count // 2)[count // 2])
            difference = np.clip(difference, -limit, limit)
            products = np.correlate(difference, difference, 'full')[count - 1 :][: LAGS + 1]
            memory = MEMORY**count
            self._products *= memory
            self._count *= memory
            self._products[: len(products)] += products
            self._count[: len(products)] += count - np.arange(len(products))
        covariance = self._products / np.maximum(self._count, 1.0)
        spectrum = covariance @ _COSINES / _OF_WHITE_NOISE
        return max(0.0, float(spectrum.min()) / _LEAST)
