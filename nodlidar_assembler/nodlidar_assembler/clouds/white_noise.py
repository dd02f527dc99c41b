"""The white noise of joint samples, apart from any motion."""

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np

MEMORY = 0.998  # weight of a sample, over that of the next one
LAGS = 32  # with fewer, a vibration spreads over the frequencies beside its own
HISTORY = 4 * LAGS  # samples
CLIPPED = 4.5  # medians; a larger third difference is a reversal
FREQUENCIES = np.linspace(np.pi / 2.0, np.pi, LAGS + 1)  # per sample, which a nod hardly has

_SHARE = np.arange(LAGS + 1) / (LAGS + 1.0)
_TAPER = np.minimum(1.0 - 6.0 * _SHARE**2 * (1.0 - _SHARE), 2.0 * (1.0 - _SHARE) ** 3)  # Parzen's


def cosines(frequencies: Array, taper: Array) -> Array:
    """Return what makes an autocovariance (lags + 1,) a spectrum (f,), shape (lags + 1, f).

    Frequencies are per sample [rad], shape (f,); the taper is that of the lags, 1 at 0.
    """
    matrix = 2.0 * np.cos(np.outer(np.arange(len(taper)), frequencies)) * taper[:, None]
    matrix[0] = 1.0
    return np.asarray(matrix)


_COSINES = cosines(FREQUENCIES, _TAPER)
# Autocovariance of the third difference of white noise of variance 1.
_OF_WHITE_NOISE = np.array([20.0, -15.0, 6.0, -1.0])
_SPECTRUM_OF_WHITE_NOISE = np.append(_OF_WHITE_NOISE, np.zeros(LAGS - 3)) @ _COSINES
_LEAST = 0.8  # of the spectrum's values over their mean, for white noise; found by simulation


class WhiteNoise:
    """Estimates the variance of white noise in joint samples of any motion.

    The third difference leaves hardly anything of a nod, and white noise is as strong at every
    frequency, while vibrations are not. So the noise is the least of the spectrum of the third
    difference, over that of white noise of variance 1, in the upper half of the frequencies
    (Blackman and Tukey 1958: the spectrum from the autocovariance).
    """

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self._time_ns, self._pitch = np.zeros(0, np.int64), np.zeros(0)
        self._new: list[tuple[Times, Array]] = []
        self._newest_ns = 0
        self._products, self._count = np.zeros(LAGS + 1), 0.0  # by lag, of as many products each

    def add(self, time_ns: Times, pitch: Array) -> None:
        """Add those of the samples [ns], [rad], ascending, that are later than all before.

        If none is, time went back, and those before are forgotten.
        """
        if len(pitch) and time_ns[-1] < self._newest_ns:
            self._forget()
        first = int(time_ns.searchsorted(self._newest_ns, side='right'))
        if first < len(pitch):
            self._new.append((time_ns[first:], pitch[first:]))
            self._newest_ns = int(time_ns[-1])

    def variance(self) -> float:
        """Return the variance [rad^2]; 0 while there are too few samples to tell."""
        if self._new:
            self._take_new()
        if self._count < HISTORY:
            return 0.0
        spectrum = self._products / self._count @ _COSINES / _SPECTRUM_OF_WHITE_NOISE
        return max(0.0, float(spectrum.min()) / _LEAST)

    def _take_new(self) -> None:
        """Take the samples that were added since the last time."""
        new = sum(len(pitch) for _, pitch in self._new)
        times, pitches = zip((self._time_ns, self._pitch), *self._new, strict=True)
        self._time_ns = np.concatenate(times)[-HISTORY:]
        self._pitch = np.concatenate(pitches)[-HISTORY:]
        self._new.clear()
        if len(self._pitch) > LAGS + 3:
            memory = MEMORY**new
            difference = _third_difference(self._time_ns, self._pitch)
            self._products = memory * self._products + _by_lag(difference)
            self._count = memory * self._count + len(difference) - LAGS


def _third_difference(time_ns: Times, pitch: Array) -> Array:
    """Return the third difference, clipped.

    It is the divided one, so stamps that jitter count as noise and uneven ones do not. Its scale
    is that which leaves the variance of white noise as at even stamps.
    """
    gap = (time_ns[1:] - time_ns[:-1]) / NS_PER_S
    a, b, c = gap[:-2], gap[1:-1], gap[2:]
    ab, bc, span = a + b, b + c, a + b + c
    weights = -b * c * bc, c * ab * span, -a * bc * span, a * b * ab
    scale = np.sqrt(sum(weight * weight for weight in weights) / _OF_WHITE_NOISE[0])
    four = pitch[:-3], pitch[1:-2], pitch[2:-1], pitch[3:]
    difference = sum(weight * each for weight, each in zip(weights, four, strict=True)) / scale
    size = np.abs(difference)
    limit = CLIPPED * np.partition(size, len(size) // 2)[len(size) // 2]
    return np.asarray(np.minimum(np.maximum(difference, -limit), limit))


def _by_lag(values: Array) -> Array:
    """Return the products of values (n,) with those after them, summed, by their distance."""
    return np.asarray(np.correlate(values, values[: len(values) - LAGS]))
