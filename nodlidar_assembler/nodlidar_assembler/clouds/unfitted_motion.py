"""How much of what smoothing leaves of joint samples is motion.

Vibrations are too fast for a smooth spline, which leaves them in the samples. They show as power
beyond that of the noise, whose variance is known otherwise (white_noise). Each frequency is added
to the spline with the gain that makes the mean square error least (Wiener 1949), and determines
what is between the samples. Where a spline misses a sharp reversal, three neighbours show it, and
the gain is larger there.
"""

from nodlidar_assembler.clouds.between_samples import (
    clipped,
    FALL,
    FREQUENCIES,
    LAGS,
    lines,
    PHASES,
    responses,
    spread,
    WIDTHS,
)
from nodlidar_assembler.clouds.white_noise import cosines
from nodlidar_common.arrays import Array
import numpy as np

MEMORY = 0.992  # weight of a sample, over that of the next one
EVIDENT = 2.0  # a median square over the noise, which that of white noise seldom exceeds
SURELY_WHITE = 2.0  # of the white noise that was found: it is the least of its spectrum
LEAST_POWER = 1e-30  # of a frequency, so that none is no motion [rad^2]
NEARLY = 0.95  # of the learned gain: neighbours that show as much leave nothing to clip
USUAL = 0.67  # median of a normal distribution's size over its standard deviation

_TAPER = 1.0 - np.arange(LAGS + 1) / (LAGS + 1.0)  # Bartlett's window
_COSINES = cosines(2.0 * np.pi * FREQUENCIES, _TAPER)
_RESPONSES = responses(FALL)


class UnfittedMotion:
    """Learns the gain with which what a fit leaves of the samples is added to it.

    Attributes
    ----------
    gain
        Mean of all frequencies, from 0, it is noise, to 1, it is motion.
    """

    def __init__(self) -> None:
        self.gain = 0.0
        self._kernel = np.zeros(_RESPONSES.shape[1])
        # Autocovariance, summed: of all that is left, of motion in it.
        self._left, self._motion = np.zeros(LAGS + 1), np.zeros(LAGS + 1)
        self._surely = 0.0  # power that no noise has, whatever its frequencies, summed

    def add(self, left: Array, new: slice, influence: Array, noise: float, white: float) -> None:
        """Learn from a fit.

        Rounding is no white noise: while the speed is constant, it has few frequencies, of which
        a smooth fit leaves all. It would pass for a vibration. So the sum of all frequencies says
        how much motion there is, and what is beyond white noise only which frequencies it has.

        Parameters
        ----------
        left
            Samples without the fit, clipped [rad], shape (n,).
        new
            Those that count.
        influence
            Of these on the fit at them and at the LAGS next ones, summed, shape (LAGS + 1,).
        noise, white
            Variance of the samples, and that of white noise in them [rad^2].
        """
        count = new.stop - new.start
        memory = MEMORY**count
        after = np.append(left[new.start :], np.zeros(LAGS))[: count + LAGS]
        products = np.correlate(after, left[new])
        beyond = products + noise * influence
        beyond[0] -= noise * count
        self._left = memory * self._left + products
        self._motion = memory * self._motion + beyond
        surely = products[0] - noise * count + min(SURELY_WHITE * white, noise) * influence[0]
        self._surely = memory * self._surely + float(surely)
        motion = np.maximum(self._motion @ _COSINES, 0.0)
        power = float(WIDTHS @ motion)
        share = min(max(self._surely, 0.0) / power, 1.0) if power else 0.0
        gain = share * motion / np.maximum(self._left @ _COSINES, share * motion + LEAST_POWER)
        self.gain = float(WIDTHS @ gain)
        self._kernel = gain @ _RESPONSES

    def motion(self, left: Array, usual: Array, noise: float) -> Array:
        """Return the motion in what is left of samples, at and between these [rad].

        Parameters
        ----------
        left, usual
            What is left of samples, and the same clipped [rad], shape (n,).
        noise
            Variance of the samples [rad^2].
        """
        gain = evident(left, noise)
        if not self.gain:
            return lines(gain * left)
        learned = spread(usual, self._kernel)
        beyond = np.where(gain > NEARLY * self.gain, gain * left - learned[::PHASES], 0.0)
        return learned + lines(beyond)


def usual_part(left: Array, noise: float) -> Array:
    """Return what is left of samples (n,) [rad], no larger than usual, with a noise [rad^2]."""
    return clipped(left, USUAL * noise**0.5)


def evident(left: Array, noise: float) -> Array:
    """Return the gains that three neighbours show without others, shape (n,).

    The median of their squares counts, so a single bad stamp shows nothing.

    Parameters
    ----------
    left
        What is left of samples [rad], shape (n,).
    noise
        Variance of the samples [rad^2].
    """
    square = np.square(left)
    before, here, after = square[:-2], square[1:-1], square[2:]
    least, most = np.minimum(before, here), np.maximum(before, here)
    median = np.maximum(least, np.minimum(most, after))
    gain = np.zeros(len(left))
    most_of_noise = EVIDENT * noise
    gain[1:-1] = 1.0 - most_of_noise / np.maximum(median, most_of_noise)
    return gain
