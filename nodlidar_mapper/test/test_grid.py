"""Occupancy of what stands in a room, against its true place."""

from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.output.grid import FREE, grid_of, GridConfig, OCCUPIED
import numpy as np


def test_a_table_top_is_occupied_though_beams_go_over_it():
    """1.6 m by 0.8 m, 0.7 m high, with a point every 0.1 m; the lidar is 1 m high, 2 m away."""
    rng = np.random.default_rng(1)
    x, y = (v.ravel() for v in np.meshgrid(np.arange(2.05, 3.6, 0.1), np.arange(-0.35, 0.4, 0.1)))
    top = np.stack([x, y, np.full(x.size, 0.7)], axis=1)
    top[:, :2] += rng.uniform(-0.02, 0.02, (len(top), 2))
    surface = Surface(top, np.tile([0.0, 0.0, 1.0], (len(top), 1)))
    pose = planar(0.0, 0.0, 0.0)
    pose[2, 3] = 1.0
    behind = np.stack([np.full(801, 6.0), np.linspace(-4.0, 4.0, 801), np.zeros(801)], axis=1)
    grid = grid_of(surface, [Keyframe(0, pose, surface, behind)], GridConfig())
    rows, columns = np.indices(grid.cells.shape)
    x, y = (
        corner + grid.resolution * (index + 0.5)
        for corner, index in zip(grid.origin, (columns, rows), strict=True)
    )
    outside = np.maximum(np.abs(x - 2.8) - 0.8, np.abs(y) - 0.4)  # distance from the top [m]
    assert np.mean(grid.cells[outside < 0.0] == OCCUPIED) > 0.95
    assert np.all(grid.cells[outside > 0.08] != OCCUPIED)
    assert np.mean(grid.cells[(outside > 0.08) & (x > 1.0) & (np.abs(y) < 0.5)] == FREE) > 0.95
