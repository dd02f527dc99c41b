"""The surfaces of a map that last: without people that walked by."""

from collections.abc import Sequence

from nodlidar_mapper.keyframe import Keyframe, surface_in_map
from nodlidar_mapper.poses import inverse, moved
from nodlidar_mapper.range_image import RangeImage
from nodlidar_mapper.surface import Surface
import numpy as np

BEYOND = 0.3  # a beam that ends so much farther went through [m]
REACH = 5.0  # points within this distance of a keyframe are compared [m]
LEAST_PASSES = 2  # keyframes from which a point is seen through, at least


def lasting_surface(keyframes: Sequence[Keyframe]) -> Surface:
    """Return the surfaces of all keyframes, without what other clouds see through.

    A point goes if beams of more keyframes pass beyond it than end on it.
    """
    surface = surface_in_map(keyframes)
    passes = np.zeros(len(surface.points), dtype=np.int64)
    hits = np.zeros_like(passes)
    for keyframe in keyframes:
        near = np.linalg.norm(surface.points - keyframe.pose[:3, 3], axis=1) < REACH
        index = np.flatnonzero(near)
        points = moved(inverse(keyframe.pose), surface.points[index])
        beyond = RangeImage(keyframe.points).beyond(points)
        passes[index] += np.isfinite(beyond) & (beyond > BEYOND)
        hits[index] += np.abs(beyond) <= BEYOND
    return surface[(passes < LEAST_PASSES) | (passes <= hits)]
