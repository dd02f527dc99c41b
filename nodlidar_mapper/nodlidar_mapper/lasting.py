"""The surfaces of a map that last: without people that walked by."""

from collections.abc import Sequence

from nodlidar_mapper.keyframe import Keyframe
from nodlidar_mapper.poses import Array, inverse, moved
from nodlidar_mapper.surface import Surface
import numpy as np
from numpy.typing import NDArray

BIN = np.radians(2.0)  # of directions [rad]
BEYOND = 0.3  # a beam that ends so much farther went through [m]
REACH = 5.0  # points within this distance of a keyframe are compared [m]
LEAST_PASSES = 2  # keyframes from which a point is seen through, at least


def lasting_surface(keyframes: Sequence[Keyframe]) -> Surface:
    """Return the surfaces of all keyframes, without what other clouds see through.

    A point goes if beams of more keyframes pass beyond it than end on it.
    """
    surface = Surface.joined([each.surface.moved(each.pose) for each in keyframes])
    passes = np.zeros(len(surface.points), dtype=np.int64)
    hits = np.zeros_like(passes)
    for keyframe in keyframes:
        near = np.linalg.norm(surface.points - keyframe.pose[:3, 3], axis=1) < REACH
        index = np.flatnonzero(near)
        points = moved(inverse(keyframe.pose), surface.points[index])
        measured = _ranges(keyframe.points)[_bins(points)]
        beyond = measured - np.linalg.norm(points, axis=1)
        passes[index] += np.isfinite(measured) & (beyond > BEYOND)
        hits[index] += np.abs(beyond) <= BEYOND
    return surface[(passes < LEAST_PASSES) | (passes <= hits)]


def _bins(points: Array) -> NDArray[np.intp]:
    """Return the direction of points (n, 3) as indices of `_ranges`, shape (n,)."""
    azimuth = np.arctan2(points[:, 1], points[:, 0]) + np.pi
    elevation = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])) + np.pi / 2.0
    column, row = (azimuth / BIN).astype(np.intp), (elevation / BIN).astype(np.intp)
    return np.asarray(row * (int(2.0 * np.pi / BIN) + 2) + column)


def _ranges(points: Array) -> Array:
    """Return the nearest range in each bin of directions [m]; inf without."""
    size = (int(np.pi / BIN) + 2) * (int(2.0 * np.pi / BIN) + 2)
    ranges = np.full(size, np.inf)
    np.minimum.at(ranges, _bins(points), np.linalg.norm(points, axis=1))
    return ranges
