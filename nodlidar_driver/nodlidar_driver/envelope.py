"""Estimates from one-sided noise: messages arrive late, never early.

Delays are taken as exponential with an unknown scale, the usual model of a queueing path: the
information is in the least delayed messages, not in the mean.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DRIFT_LIMIT = 500e-6  # steepest slope that is looked for; quartz is ten times better
_DRIFT_EXPECTED = 50e-6  # half of all quartzes are within this of each other
_RESOLUTION_MS = 0.02  # mean delays below this are not told apart
_COARSE = np.linspace(-DRIFT_LIMIT, DRIFT_LIMIT, 41, dtype=np.float64)
_FINE = np.linspace(-25e-6, 25e-6, 51, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Line:
    """A line under a cloud of points: its value at the place that was asked for, its slope."""

    value: float
    slope: float
    scatter: float  # mean height of the points above the line


def lower_line(x: NDArray[np.float64], y: NDArray[np.float64], at: float) -> Line:
    """Return the line that points with one-sided (exponential) noise lie above.

    For a given slope the likelihood depends only on the mean height of the points above the
    lowest one. The slope is the posterior mean within DRIFT_LIMIT under a Cauchy prior, so that
    a few points do not tilt the line; its height is that of :func:`least`.

    Parameters
    ----------
    x, y
        Points, shape (n,), n >= 1, in one unit.
    at
        The x at which the line's value is wanted.
    """
    along = x - at
    slope = _mean_slope(along, y, _COARSE)
    finer: NDArray[np.float64] = np.clip(slope + _FINE, -DRIFT_LIMIT, DRIFT_LIMIT)
    slope = _mean_slope(along, y, finer)
    heights = y - slope * along
    return Line(least(heights), slope, float(heights.mean() - heights.min()))


def least(values: NDArray[np.float64]) -> float:
    """Return where exponential noise begins, given values with it, shape (n,), n >= 1.

    That is the least value less what the least of n delays is expected to be (the unbiased
    estimate of least variance).
    """
    lowest = float(values.min())
    return lowest - (float(values.mean()) - lowest) / max(len(values) - 1, 1)


def _mean_slope(
    x: NDArray[np.float64], y: NDArray[np.float64], slopes: NDArray[np.float64]
) -> float:
    heights = y - slopes[:, None] * x
    scatter = heights.mean(axis=1) - heights.min(axis=1)
    cost = len(x) * np.log(scatter + _RESOLUTION_MS) + np.log1p((slopes / _DRIFT_EXPECTED) ** 2)
    return float(np.average(slopes, weights=np.exp(cost.min() - cost)))
