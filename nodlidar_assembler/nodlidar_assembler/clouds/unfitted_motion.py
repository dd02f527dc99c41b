"""How much of what smoothing leaves of joint samples is motion.

Vibrations are too fast for a smooth spline, which leaves them in the samples. They show as power
beyond that of the noise, whose variance is known otherwise (white_noise). What is left is
interpolated and added to the spline, with the gain that makes the mean square error least (Wiener
1949). At gain 1 the samples themselves are interpolated. Where a spline misses a sharp reversal,
three neighbours show it, and the gain is larger there.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEMORY = 0.99  # weight of a sample, over that of the next one
CLIPPED = 4.5  # medians; what is left of a sample counts up to that, as its stamp may be bad
EVIDENT = 2.0  # a median square over the noise, which that of white noise seldom exceeds
NEARLY = 0.95  # of the learned gain: neighbours that show as much leave nothing to clip
USUAL = 0.67  # median of a normal distribution's size over its standard deviation
# Weights of the autocovariance of what is left, at a lag of 0 and 1 samples: mean square of the
# interpolation, and its mean product with a motion that has no frequency above half the rate.
_OF_SQUARE = np.array([2.0, 1.0]) / 3.0
_OF_MOTION = np.array([0.774, 0.258])  # integral of sinc(f)^2 cos(2 pi f lag) over these


class UnfittedMotion:
    """Learns the gain with which what a fit leaves of the samples is added to it.

    Attributes
    ----------
    gain
        From 0, it is noise, to 1, it is motion.
    """

    def __init__(self) -> None:
        self.gain = 0.0
        # Autocovariance at a lag of 0 and 1 samples, summed: of all that is left, of motion in it.
        self._left, self._motion = np.zeros(2), np.zeros(2)

    def add(self, left: Array, influence: Array, noise: float) -> None:
        """Learn from a fit.

        Parameters
        ----------
        left
            Samples without the fit, clipped [rad], shape (n,).
        influence
            Of samples on the fit at them and at the next ones, summed, shape (2,).
        noise
            Variance of the samples [rad^2].
        """
        memory = MEMORY ** len(left)
        products = np.array([left @ left, left[1:] @ left[:-1]])
        of_noise = noise * (np.array([len(left), 0.0]) - influence)
        self._left = memory * self._left + products
        self._motion = memory * self._motion + products - of_noise
        square = float(_OF_SQUARE @ self._left)
        gain = float(_OF_MOTION @ self._motion) / square if square else 0.0
        self.gain = min(max(gain, 0.0), 1.0)

    def motion(self, left: Array, usual: Array, noise: float) -> Array:
        """Return the motion in what is left of samples [rad], shape (n,).

        Parameters
        ----------
        left, usual
            What is left of samples, and the same clipped [rad], shape (n,).
        noise
            Variance of the samples [rad^2].
        """
        gain = evident(left, noise)
        return np.where(gain > NEARLY * self.gain, gain * left, self.gain * usual)


def clipped(left: Array, noise: float) -> Array:
    """Return what is left of samples (n,) [rad], no larger than usual, with a noise [rad^2]."""
    size = np.abs(left)
    median = float(np.partition(size, len(size) // 2)[len(size) // 2])
    limit = CLIPPED * max(median, USUAL * noise**0.5)
    return np.asarray(np.minimum(np.maximum(left, -limit), limit))


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
