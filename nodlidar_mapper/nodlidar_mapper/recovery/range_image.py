"""What a keyframe sees in each direction."""

from nodlidar_common.arrays import Array
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

BIN = np.radians(2.0)  # of directions [rad]
REACH = 7.0  # m
_COLUMNS = round(2.0 * np.pi / BIN)
_ROWS = int(np.pi / BIN) + 2


class RangeImage:
    """The nearest range in each bin of directions, and in those beside it.

    A beam along a floor or a wall ends far beyond one that is a bin nearer: it went over that
    surface, not through it. `output.lasting.ranges_beyond` is finer, for what the finished map
    leaves out. Here it would take an eighth more of the time of each cloud, for the same poses.

    Parameters
    ----------
    points
        In the frame of the sensor [m], shape (n, 3).
    """

    def __init__(self, points: Array) -> None:
        ranges = np.full((_ROWS, _COLUMNS), np.inf)
        np.minimum.at(ranges.reshape(-1), _bins(points), np.linalg.norm(points, axis=1))
        nearest = minimum_filter(ranges, 3, mode=('nearest', 'wrap'))
        self._ranges = np.where(np.isfinite(ranges), nearest, np.inf).ravel()

    def beyond(self, points: Array) -> Array:
        """Return how far beams go beyond points (n, 3) in the same frame [m].

        It is inf without beams, and beyond REACH, where a floor within one bin is metres long.
        """
        distances = np.linalg.norm(points, axis=1)
        near = distances <= REACH
        return np.asarray(np.where(near, self._ranges[_bins(points)] - distances, np.inf))


def _bins(points: Array) -> NDArray[np.intp]:
    azimuth = np.arctan2(points[:, 1], points[:, 0]) + np.pi
    elevation = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])) + np.pi / 2.0
    column, row = (azimuth / BIN).astype(np.intp), (elevation / BIN).astype(np.intp)
    return np.asarray(row * _COLUMNS + column % _COLUMNS)
