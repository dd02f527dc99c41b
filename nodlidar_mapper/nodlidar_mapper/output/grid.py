"""An occupancy grid from a map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array, Mask
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.output.lasting import lasting_surface
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_dilation

# As in nav_msgs/OccupancyGrid.
UNKNOWN, FREE, OCCUPIED = -1, 0, 100
NO_SURFACE = 'the map has no surface yet'
LEAST_POINTS = 2  # in an occupied cell
MARGIN = 1.0  # around all points [m]
LEVEL = 0.7  # vertical part of the normal, beyond which a surface is a shelf or a table top
PATCH = 0.1  # side of such a surface that a point of the map stands for, by default [m]
LAYER = 0.1  # of the heights that beams cross [m]
# A thin leg fills a part of a cube: something is there, unless this many times as many keyframes
# see through the cube as see a point in it.
OUTWEIGHED = 5


@dataclass(frozen=True)
class GridConfig:
    """Occupancy grid."""

    resolution: float = parameter(
        0.05, 'Side of a cell of the grid', unit='m', minimum=0.01, maximum=1.0
    )
    band_bottom: float = parameter(
        0.1,
        'Lowest z in the map that counts as occupied; z = 0 is that of odom_frame',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    band_top: float = parameter(
        1.8,
        'Highest z in the map that counts as occupied',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    free_gap: float = parameter(
        0.5,
        'A cell is free if beams crossed it from band_bottom up, with no vertical gap larger than '
        'this: what is lower may stand there unseen',
        unit='m',
        minimum=0.0,
        maximum=100.0,
    )
    narrowest_passage: float = parameter(
        0.3,
        'Space between things is not free if it is narrower: of a table top, a few rows are seen. '
        'At most the width of the robot',
        unit='m',
        minimum=0.0,
        maximum=2.0,
    )
    hole_depth: float = parameter(
        0.3,
        'Where a beam goes on so far below band_bottom, there is no floor: a cell is not free',
        unit='m',
        minimum=0.1,
        maximum=100.0,
    )

    def check_together(self) -> None:
        """Raise ParameterError for heights of which none counts."""
        if self.band_top <= self.band_bottom:
            limit = f'above band_bottom = {self.band_bottom} m'
            raise ParameterError('band_top', limit, self.band_top)


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


def surface_and_grid(keyframes: Sequence[Keyframe], config: GridConfig) -> tuple[Surface, Grid]:
    """Return the lasting surfaces and the grid of a map; raises as `grid_of`."""
    surface = lasting_surface(keyframes)
    return surface, grid_of(surface, keyframes, config)


def grid_of(surface: Surface, keyframes: Sequence[Keyframe], config: GridConfig) -> Grid:
    """Return the grid of a map: occupied by surfaces within a band of heights.

    A cell is free where beams of keyframes cross it at all heights that are seen, and neither
    surfaces nor single points are there or close on both sides: a beam over a chair, or between
    its legs, shows nothing of the chair. Nor is it free where beams go on below the floor.

    Raises
    ------
    EmptyMapError
        If there is no surface.
    """
    points = surface.points
    if not len(points):
        raise EmptyMapError(NO_SURFACE)
    cubes = _Cubes.around(points, config)
    passes = np.zeros(cubes.shape, dtype=np.uint16)
    passes_of = passes.reshape(-1)  # by number
    ends = []
    hole = np.zeros(cubes.shape[1:], dtype=np.bool_)
    for keyframe in keyframes:
        cloud = keyframe.placed_cloud
        end = np.unique(cubes.numbers(cloud.points))
        before = passes_of[end]
        beams = _along_beams(cloud, cubes.size)
        passes_of[cubes.numbers(beams)] += 1  # all its beams once
        below = beams[beams[:, 2] < config.band_bottom - config.hole_depth]
        hole.reshape(-1)[cubes.cell_numbers(below)] = True
        passes_of[end] = before
        ends.append(end)
    hit, hits = np.unique(np.concatenate(ends), return_counts=True)
    hit = hit[OUTWEIGHED * hits > passes_of[hit]]
    occupied = cubes.cells(cubes.numbers(_covering(surface, cubes.size)), LEAST_POINTS)
    places = np.stack([(keyframe.pose @ keyframe.robot)[:3, 3] for keyframe in keyframes])
    robot = _disc(config.narrowest_passage / 2.0 / cubes.size)
    stood = binary_dilation(cubes.cells(cubes.cell_numbers(places)), robot)
    cells = np.full(occupied.shape, UNKNOWN, dtype=np.int8)
    cells[_seen(passes, round(config.free_gap / LAYER)) | stood] = FREE
    filled = occupied | cubes.cells(hit) | (hole & ~stood)
    cells[filled | binary_closing(filled, robot)] = UNKNOWN  # without closing, at the border
    cells[occupied] = OCCUPIED
    return Grid(cells, (float(cubes.corner[0]), float(cubes.corner[1])), cubes.size)


@dataclass(frozen=True, slots=True, eq=False)
class _Cubes:
    """Cubes above the cells of a grid, in the band of heights, numbered layer by layer.

    corner is that of the first one, and top the end of the band [m]; shape is layers, rows along
    y and columns along x.
    """

    corner: Array
    top: float
    size: float
    shape: tuple[int, int, int]

    @classmethod
    def around(cls, points: Array, config: GridConfig) -> _Cubes:
        """Return those around points (n, 3) [m]."""
        size, band = config.resolution, config.band_top - config.band_bottom
        low = np.floor((points[:, :2].min(axis=0) - MARGIN) / size) * size
        columns, rows = np.ceil((points[:, :2].max(axis=0) + MARGIN - low) / size).astype(int)
        layers = max(int(np.ceil(band / LAYER)), 1)
        corner = np.array([*low, config.band_bottom])
        return cls(corner, config.band_top, size, (layers, int(rows), int(columns)))

    def numbers(self, points: Array) -> NDArray[np.intp]:
        """Return the numbers of the cubes of those points (n, 3) that are in any."""
        points = points[(self.corner[2] <= points[:, 2]) & (points[:, 2] <= self.top)]
        edges = np.array([self.size, self.size, LAYER])
        column, row, layer = np.floor((points - self.corner) / edges).astype(np.intp).T
        layers, rows, columns = self.shape
        inside = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
        number = (np.minimum(layer, layers - 1) * rows + row) * columns + column
        return np.asarray(number[inside])

    def cells(self, numbers: NDArray[np.intp], least: int = 1) -> Mask:
        """Return which cells (rows, columns) have so many of the numbers above them."""
        _, rows, columns = self.shape
        number, counts = np.unique(numbers % (rows * columns), return_counts=True)
        cells = np.zeros((rows, columns), dtype=np.bool_)
        cells.reshape(-1)[number[counts >= least]] = True
        return cells

    def cell_numbers(self, points: Array) -> NDArray[np.intp]:
        """Return the numbers of the cells of points (n, 3) [m] at any height."""
        return self.numbers(np.column_stack([points[:, :2], np.full(len(points), self.corner[2])]))


def _seen(passes: NDArray[np.uint16], most: int) -> Mask:
    """Return the cells whose layers (k, rows, columns) beams passed, but for so many in a row.

    Those above all beams do not count: out of reach of the lidar, where only what hangs could be.
    """
    gap, largest = np.zeros((2, *passes.shape[1:]), dtype=np.int16)
    passed = np.zeros(passes.shape[1:], dtype=np.bool_)
    for layer in passes:
        crossed = layer > 0
        np.maximum(largest, gap, out=largest, where=crossed)
        gap += 1
        gap[crossed] = 0
        passed |= crossed
    return np.asarray(passed & (largest <= most))


def _disc(radius: float) -> Mask:
    """Return which cells of a square are within a radius [cells] of its middle."""
    steps = np.arange(-int(radius), int(radius) + 1)
    return np.asarray(np.hypot(*np.meshgrid(steps, steps)) <= radius)


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


def _along_beams(seen: Seen, step: float) -> Array:
    """Return points every step [m] along the beams of a cloud, before their ends, (n, 3)."""
    length = np.linalg.norm(seen.towards, axis=1)
    count = np.maximum((length / step).astype(np.intp) - 1, 0)
    beam = np.repeat(np.arange(len(length)), count)
    number = np.arange(len(beam)) - np.repeat(np.cumsum(count) - count, count)
    share = (number * step / length[beam])[:, None]
    return np.asarray(seen.origins[beam] - share * seen.towards[beam])
