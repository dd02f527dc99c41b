"""Estimates from one-sided noise: messages arrive late, never early.

Delays are assumed to be exponential with an unknown scale, the usual model of a queueing path:
the information is in the least delayed messages, not in the mean.
"""

from dataclasses import dataclass

from nodlidar_common.arrays import Array
import numpy as np

DRIFT_LIMIT = 500e-6  # steepest slope considered; quartz is ten times better
_DRIFT_EXPECTED = 50e-6  # half of all quartzes are within this of each other
_RESOLUTION_MS = 0.02  # mean delays below this are not distinguished
_COARSE = np.linspace(-DRIFT_LIMIT, DRIFT_LIMIT, 41, dtype=np.float64)
_FINE = np.linspace(-25e-6, 25e-6, 51, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Line:
    """A line below noisy points: its value at one x, and its slope."""

    value: float
    slope: float
    scatter: float  # mean height of the points above the line


def lower_line(x: Array, y: Array, at: float) -> Line:
    """Return the line above which points with one-sided (exponential) noise lie.

    For a given slope the likelihood depends only on the mean height of the points above the
    lowest one. The slope is the posterior mean within DRIFT_LIMIT under a Cauchy prior, so that
    a few points do not tilt the line; its height is that of :func:`least`.

    Parameters
    ----------
    x, y
        Points, shape (n,), n >= 1, in one unit.
    at
        The x of the line's value.
    """
    along = x - at
    slope = _mean_slope(along, y, _COARSE)
    finer: Array = np.clip(slope + _FINE, -DRIFT_LIMIT, DRIFT_LIMIT)
    slope = _mean_slope(along, y, finer)
    heights = y - slope * along
    return Line(least(heights), slope, float(heights.mean() - heights.min()))


def least(values: Array) -> float:
    """Return the lower bound of values with exponential noise, shape (n,), n >= 1.

    That is the least value less the expected least of n delays (the unbiased estimate of minimum
    variance).
    """
    lowest = float(values.min())
    return lowest - (float(values.mean()) - lowest) / max(len(values) - 1, 1)


def _mean_slope(x: Array, y: Array, slopes: Array) -> float:
    heights = y - slopes[:, None] * x
    scatter = heights.sum(axis=1) / len(x) - heights.min(axis=1)
    cost = len(x) * np.log(scatter + _RESOLUTION_MS) + np.log1p((slopes / _DRIFT_EXPECTED) ** 2)
    weights = np.exp(cost.min() - cost)
    return float((slopes * weights).sum() / weights.sum())
