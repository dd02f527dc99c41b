"""What vibrations do between joint samples.

Samples do not show whether a vibration is below half their rate or above it: a frequency f per
sample and its aliases 1 - f, 1 + f and so on have the same samples. The power of vibrations falls
with the FALL-th power of the frequency, so each counts as likely as that.

Values of n samples and between these are at PHASES places per sample, (n - 1) PHASES + 1 in all.
"""

from functools import lru_cache

from nodlidar_common.arrays import Array
import numpy as np

LAGS = 8  # samples on either side that count
PHASES = 4
# With 2, vibrations are nearly lines from sample to sample; with 4, those above half the rate do
# harm.
FALL = 3.0
# A spline with the least jerk takes vibrations for the slowest that have these samples.
SPLINE_FALL = 6.0
ALIASES = 6  # multiples of the rate, of which a vibration is above or below
CACHED = 64  # numbers of samples
CLIPPED = 4.5  # medians; more is a reversal, or a bad stamp

FREQUENCIES = np.linspace(0.0, 0.5, 2 * LAGS + 1)  # per sample
WIDTHS = np.full(len(FREQUENCIES), 1.0 / (2 * LAGS))  # shares of all frequencies, each
WIDTHS[[0, -1]] /= 2.0


def responses(fall: float) -> Array:
    """Return what a gain of 1 at each frequency adds around a sample, (f, 2 LAGS PHASES + 1)."""
    frequency = np.abs(FREQUENCIES[:, None] + np.arange(-ALIASES, ALIASES + 1))
    likely = np.maximum(frequency, 1e-6) ** -fall
    likely *= WIDTHS[:, None] / likely.sum(axis=1, keepdims=True)
    distance = np.arange(-LAGS * PHASES, LAGS * PHASES + 1) / PHASES
    waves = np.cos(2.0 * np.pi * frequency[:, :, None] * distance)
    return np.asarray(np.einsum('fa,fad->fd', likely, waves))


def _alias_kernel() -> Array:
    """Return what a second difference of 1 at a sample adds to a spline around it."""
    bend = 2.0 * np.cos(2.0 * np.pi * FREQUENCIES[1:]) - 2.0  # of a vibration, over its amplitude
    beyond = (responses(FALL) - responses(SPLINE_FALL))[1:]
    return np.asarray((1.0 / bend) @ beyond)


_ALIAS_KERNEL = _alias_kernel()


def spread(values: Array, kernel: Array) -> Array:
    """Return the sum of kernels around samples of values (n,), at and between these."""
    apart = np.zeros((len(values) - 1) * PHASES + 1)
    apart[::PHASES] = values
    return np.convolve(apart, kernel)[LAGS * PHASES :][: len(apart)]


def lines(values: Array) -> Array:
    """Return values (n,) of samples, at and between these, by lines."""
    return np.interp(_fine(len(values)), np.arange(len(values)), values)


def at(wanted: Array, place: Array, values: Array) -> Array:
    """Return values at and between samples at the places wanted, of the shape of these.

    Parameters
    ----------
    wanted, place
        Of the values wanted, and of the samples (n,), ascending, both on the same scale.
    values
        Shape ((n - 1) PHASES + 1,).
    """
    return np.interp(wanted, lines(place), values)


def aliases(place: Array, pitch: Array) -> Array:
    """Return what a spline lacks at and between samples, as vibrations may be faster [rad].

    A bend counts up to that of most samples, as reversals are no vibrations.

    Parameters
    ----------
    place, pitch
        Of the samples, ascending, and the spline's pitch there [rad], shape (n,).
    """
    if len(place) < 3:
        return np.zeros((len(place) - 1) * PHASES + 1)
    gap = place[1:] - place[:-1]
    slope = (pitch[1:] - pitch[:-1]) / gap
    bends = np.zeros(len(place))
    bends[1:-1] = clipped((slope[1:] - slope[:-1]) / (gap[1:] + gap[:-1]))
    return spread(2.0 * _median(gap) ** 2 * bends, _ALIAS_KERNEL)


def clipped(values: Array, least: float = 0.0) -> Array:
    """Return values (n,) clipped at CLIPPED times their median size, or a least one if larger."""
    limit = CLIPPED * max(_median(np.abs(values)), least)
    return np.asarray(np.minimum(np.maximum(values, -limit), limit))


def _median(values: Array) -> float:
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


@lru_cache(CACHED)
def _fine(count: int) -> Array:
    """Return the places at and between so many samples, in samples."""
    return np.arange((count - 1) * PHASES + 1) / PHASES
