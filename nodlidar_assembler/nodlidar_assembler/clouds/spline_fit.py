"""Cubic splines of several roughnesses, fitted to joint samples.

The pitch is a cubic spline with a knot every KNOT, so its jerk is constant from knot to knot. The
jerk of an interval is normal with variance q / KNOT, where each interval has its own intensity q:
the larger it is, the more the motion may bend there. q follows from the samples by expectation
maximisation for a Student's t distribution of the jerk with NU degrees of freedom and scale q0. So
legs become smooth and reversals sharp, without any assumption about the shape of either.
"""

from functools import lru_cache
from typing import NamedTuple

from nodlidar_assembler.clouds.pitch import SplineError
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtri

KNOT_NS = 10_000_000
KNOT = KNOT_NS / NS_PER_S
ROUGHNESS = np.array([[2e3], [3e5]])  # q0 of each spline [rad^2/s^5]
NU = 0.3  # the smaller, the heavier the tails
STRIDE = 2.0  # expectation maximisation is slow: each of its steps is taken this many times
RIDGE = 1e-6  # keeps a spline finite where no sample is [1/rad^2]
MOST_INTENSITY = 1e14  # of a jump by 100 rad in an interval; beyond, rounding is all [rad^2/s^5]
ACCELERATION = 1e4  # that no servo reaches, for the same reason [rad/s^2]
CACHED = 64  # lengths of windows, which differ by the gaps between samples

# Four basis functions, as polynomials of the share of an interval.
_BASIS = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
_FOUR = np.arange(4)[:, None]


class Splines(NamedTuple):
    """Splines of m roughnesses with c coefficients each, fitted to n samples.

    Attributes
    ----------
    coefficients
        Shape (m, c).
    pitch, variance
        At the samples [rad], [rad^2], shape (m, n).
    intensity
        q of each interval, improved by these samples, shape (m, c - 3).
    information
        Of the samples: with which each counts, over its variance [1/rad^2], shape (m, n).
    spread
        Root of the covariance of each spline at the samples [rad], shape (m, n, c).
    """

    coefficients: Array
    pitch: Array
    variance: Array
    intensity: Array
    information: Array
    spread: Array

    def influence(self, samples: slice, lags: int) -> Array:
        """Return the influence of samples on each spline at them and at the next ones, summed.

        Its shape is (m, lags + 1).
        """
        after = self.spread[:, samples.start :]
        informed = self.spread[:, samples] * self.information[:, samples, None]
        splines, count = informed.shape[:2]
        products = np.zeros((splines, count, after.shape[1] + lags))
        products[:, :, : after.shape[1]] = informed @ after.transpose(0, 2, 1)
        row = np.arange(count)[:, None]
        return np.asarray(products[:, row, row + np.arange(lags + 1)].sum(axis=1))


def fit(place: Array, pitch: Array, noise: Array, weight: Array, intensity: Array) -> Splines:
    """Fit a spline of each roughness to the samples, and improve its intensities by one step.

    Parameters
    ----------
    place, pitch
        Of the samples, in knots from the first one, and [rad], shape (n,).
    noise
        Variance of the samples, for each spline [rad^2], shape (m, 1).
    weight
        With which each sample counts, shape (n,).
    intensity
        q of each interval, for each spline, shape (m, c - 3).
    """
    intervals, samples = intensity.shape[1], len(place)
    rows = _rows(place, intervals)
    information = weight / noise
    known = np.concatenate([information, KNOT / intensity], axis=1)
    root = _roots((rows.T * known[:, None, :]) @ rows + _weak_prior(intervals))
    spread = rows @ root
    wanted = (information * pitch)[:, None, :] @ spread[:, :samples]
    coefficients = (wanted @ root.transpose(0, 2, 1))[:, 0]
    mean = coefficients @ rows.T
    variance = np.square(spread) @ np.ones(intervals + 3)
    power = KNOT * (mean[:, samples:] ** 2 + variance[:, samples:])
    improved = (NU * ROUGHNESS + power) / (NU + 1.0)
    return Splines(
        coefficients,
        mean[:, :samples],
        variance[:, :samples],
        np.minimum(intensity * (improved / intensity) ** STRIDE, MOST_INTENSITY),
        information,
        spread[:, :samples],
    )


def value(coefficients: Array, place: Array) -> Array:
    """Return a spline [rad] of coefficients (c,) at places in knots from the first one, (n,)."""
    polynomials = _BASIS.T @ coefficients[_four(len(coefficients) - 3)]
    first = place.astype(np.intp)
    share = place - first
    constant, linear, square, cube = polynomials.take(first, axis=1)
    return np.asarray(((cube * share + square) * share + linear) * share + constant)


def _rows(place: Array, intervals: int) -> Array:
    """Return the matrix from coefficients to samples at places, and to the jerk of intervals."""
    samples = len(place)
    first = place.astype(np.intp)
    rows = np.zeros((samples + intervals, intervals + 3))
    rows[np.arange(samples), first + _FOUR] = _BASIS @ (place - first) ** _FOUR
    rows[samples:] = _jerk(intervals)
    return rows


@lru_cache(CACHED)
def _four(intervals: int) -> NDArray[np.intp]:
    """Return the indices of the coefficients that count in each interval, shape (4, intervals)."""
    return _FOUR + np.arange(intervals)


@lru_cache(CACHED)
def _jerk(intervals: int) -> Array:
    """Return the matrix from coefficients to the jerk of each interval."""
    return np.diff(np.eye(intervals + 3), 3, axis=0) / KNOT**3


@lru_cache(CACHED)
def _weak_prior(intervals: int) -> Array:
    """Return information that keeps a spline finite where no sample is."""
    acceleration = np.diff(np.eye(intervals + 3), 2, axis=0) / KNOT**2 / ACCELERATION
    return RIDGE * np.eye(intervals + 3) + acceleration.T @ acceleration


def _roots(information: Array) -> Array:
    """Return roots V of the inverses V V^T of matrices, shape (m, c, c).

    No call here is one that a BLAS library spreads over threads: for matrices of this size that
    takes milliseconds if the processors are busy. dpotri is such a call.
    """
    roots = np.empty_like(information)
    for matrix, root in zip(information, roots, strict=True):
        factor, failed = dpotrf(matrix.T, overwrite_a=1)
        if failed:
            raise SplineError('the joint samples do not determine a spline')
        root[:] = dtrtri(factor, overwrite_c=1)[0]
    return roots
