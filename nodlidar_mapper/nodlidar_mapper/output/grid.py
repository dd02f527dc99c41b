"""An occupancy grid from a map."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.errors import NodlidarError
from nodlidar_common.parameters import parameter
from nodlidar_mapper.geometry.poses import Array, moved
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe
import numpy as np
from numpy.typing import NDArray

# As in nav_msgs/OccupancyGrid.
UNKNOWN, FREE, OCCUPIED = -1, 0, 100
LEAST_POINTS = 2  # in an occupied cell
MARGIN = 1.0  # around all points [m]
LEVEL = 0.7  # vertical part of the normal, beyond which a surface is a shelf or a table top
PATCH = 0.1  # side of such a surface that a point of the map stands for, by default [m]


@dataclass(frozen=True)
class GridConfig:
    """Occupancy grid."""

    resolution: float = parameter(
        0.05, 'Side of a cell of the grid', unit='m', minimum=0.01, maximum=1.0
    )
    height_min: float = parameter(
        0.1, 'Lowest height that counts as occupied', unit='m', minimum=-100.0, maximum=100.0
    )
    height_max: float = parameter(
        1.8, 'Highest height that counts as occupied', unit='m', minimum=-100.0, maximum=100.0
    )


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Occupancy of the plane.

    Attributes
    ----------
    cells
        UNKNOWN, FREE or OCCUPIED, shape (rows along y, columns along x).
    origin
        x, y of the corner of cell (0, 0) in the map [m].
    resolution
        Side of a cell [m].
    """

    cells: NDArray[np.int8]
    origin: tuple[float, float]
    resolution: float


class EmptyMapError(NodlidarError):
    """A map without surfaces."""


def grid_of(surface: Surface, keyframes: Sequence[Keyframe], config: GridConfig) -> Grid:
    """Return the grid of a map: occupied by surfaces within a band of heights.

    A cell is free where a beam of a keyframe crosses it within the band, and nothing is there.

    Raises
    ------
    EmptyMapError
        If there is no surface.
    """
    points = surface.points
    if not len(points):
        raise EmptyMapError('the map has no surface yet')
    size = config.resolution
    low = np.floor((points[:, :2].min(axis=0) - MARGIN) / size) * size
    shape = np.ceil((points[:, :2].max(axis=0) + MARGIN - low) / size).astype(int)
    cells = np.full((shape[1], shape[0]), UNKNOWN, dtype=np.int8)

    def indices(at: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        at = at[(config.height_min <= at[:, 2]) & (at[:, 2] <= config.height_max)]
        column, row = np.floor((at[:, :2] - low) / size).astype(np.intp).T
        inside = (column >= 0) & (row >= 0) & (column < shape[0]) & (row < shape[1])
        return row[inside], column[inside]

    for keyframe in keyframes:
        cells[indices(_along_beams(keyframe, size))] = FREE
    counts = np.zeros(cells.shape, dtype=np.int64)
    np.add.at(counts, indices(_covering(surface, size)), 1)
    cells[counts >= LEAST_POINTS] = OCCUPIED
    return Grid(cells, (float(low[0]), float(low[1])), size)


def _covering(surface: Surface, size: float) -> Array:
    """Return the points of a surface, and what level ones stand for, every half a cell, (n, 3).

    A wall has points above each other in a cell; a table top has none at all in most of them.
    """
    level = surface.points[np.abs(surface.normals[:, 2]) > LEVEL]
    count = max(round(2.0 * PATCH / size), 1)
    across = PATCH * ((np.arange(count) + 0.5) / count - 0.5)
    x, y = np.meshgrid(across, across)
    patch = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return np.concatenate([surface.points, (level[:, None] + patch).reshape(-1, 3)])


def _along_beams(keyframe: Keyframe, step: float) -> Array:
    """Return points every step [m] along the beams of a keyframe, before their ends, (n, 3)."""
    start = keyframe.pose[:3, 3]
    ends = moved(keyframe.pose, keyframe.points)
    length = np.linalg.norm(ends - start, axis=1)
    count = np.maximum((length / step).astype(np.intp) - 1, 0)
    beam = np.repeat(np.arange(len(ends)), count)
    number = np.arange(len(beam)) - np.repeat(np.cumsum(count) - count, count)
    share = (number * step / length[beam])[:, None]
    return np.asarray(start + share * (ends[beam] - start))
