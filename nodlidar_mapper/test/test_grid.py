"""Occupancy of what stands in a room, against its true place."""

from dataclasses import replace

from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.output.grid import FREE, grid_of, GridConfig, OCCUPIED, UNKNOWN
import numpy as np
import pytest
from rooms import keyframe_of

FAR = 6.0  # where the wall is [m]


def level_fan(height, more=()):
    """Return a keyframe of a lidar at x = y = 0 that sees the wall, and more points, level."""
    y = np.linspace(-4.0, 4.0, 801)
    behind = np.stack([np.full(801, FAR), y, np.zeros(801)], axis=1)
    pose = planar(0.0, 0.0, 0.0)
    pose[2, 3] = height
    points = np.concatenate([behind, np.reshape(more, (-1, 3)) - pose[:3, 3]])
    return keyframe_of(points, pose)


def walls():
    """Return the surface of the wall and of one behind the lidar, both 8 m wide."""
    x, y, z = np.meshgrid((-0.5, FAR), np.arange(-4.0, 4.0, 0.02), (0.5, 1.0))
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    return Surface(points, np.tile([-1.0, 0.0, 0.0], (len(points), 1)))


def table_top(x):
    """Return a level surface, 0.8 m wide and 0.7 m high, with points at x and every 0.1 m in y."""
    x, y = (v.ravel() for v in np.meshgrid(x, np.arange(-0.35, 0.4, 0.1)))
    top = np.stack([x, y, np.full(x.size, 0.7)], axis=1)
    return Surface(top, np.tile([0.0, 0.0, 1.0], (len(top), 1)))


def centres(grid):
    """Return x and y of the middle of each cell [m]."""
    rows, columns = np.indices(grid.cells.shape)
    return (
        corner + grid.resolution * (index + 0.5)
        for corner, index in zip(grid.origin, (columns, rows), strict=True)
    )


def test_a_table_top_is_occupied_though_beams_go_over_it():
    """1.6 m by 0.8 m, 0.7 m high, with a point every 0.1 m, 2 m away."""
    rng = np.random.default_rng(1)
    surface = table_top(np.arange(2.05, 3.6, 0.1))
    surface.points[:, :2] += rng.uniform(-0.02, 0.02, (len(surface.points), 2))
    grid = grid_of(surface, [level_fan(z) for z in (0.15, 0.55, 0.95)], GridConfig())
    x, y = centres(grid)
    outside = np.maximum(np.abs(x - 2.8) - 0.8, np.abs(y) - 0.4)  # distance from the top [m]
    assert np.mean(grid.cells[outside < 0.0] == OCCUPIED) > 0.95
    assert np.all(grid.cells[outside > 0.08] != OCCUPIED)
    assert np.mean(grid.cells[(outside > 0.08) & (x > 1.0) & (np.abs(y) < 0.5)] == FREE) > 0.95


@pytest.mark.parametrize(('apart', 'between'), [(0.3, UNKNOWN), (0.5, FREE)])
def test_between_rows_that_no_robot_fits_in_a_table_top_is_not_free(apart, between):
    """Points of two rows stand for 0.05 m on both sides; a robot is at least 0.3 m wide."""
    surface = table_top([3.0 - apart / 2.0, 3.0 + apart / 2.0])
    grid = grid_of(surface, [level_fan(z) for z in (0.15, 0.55, 0.95)], GridConfig())
    x, y = centres(grid)
    assert np.all(grid.cells[(np.abs(x - 3.0) < 0.06) & (np.abs(y) < 0.2)] == between)


@pytest.mark.parametrize(('lowest', 'value'), [(0.65, FREE), (0.75, UNKNOWN)])
def test_what_is_seen_only_from_above_is_not_free(lowest, value):
    """The band begins at 0.1 m, and at most 0.5 m may be unseen; it goes to 1.8 m, unseen."""
    grid = grid_of(walls(), [level_fan(1.05), level_fan(lowest)], GridConfig())
    x, y = centres(grid)
    assert np.all(grid.cells[(x > 1.0) & (x < 5.5) & (np.abs(y) < 0.3)] == value)
    assert np.all(grid.cells[np.hypot(x, y) < 0.1] == FREE)  # where the robot stands


@pytest.mark.parametrize(('depth', 'value'), [(0.1, FREE), (1.0, UNKNOWN)])
def test_a_hole_in_the_floor_is_not_free_where_beams_go_on_below_it(depth, value):
    """The lidar sees the bottom from 3 m to 5 m away."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(3.0, 5.0, 0.1), np.arange(-1.0, 1.0, 0.1)))
    bottom = np.column_stack([x, y, np.full(len(x), -depth)])
    keyframes = [level_fan(0.15), level_fan(0.55), level_fan(1.0, bottom)]
    grid = grid_of(walls(), keyframes, GridConfig())
    x, y = centres(grid)
    assert np.all(grid.cells[(np.abs(x - 4.0) < 0.7) & (np.abs(y) < 0.5)] == value)
    assert np.all(grid.cells[(np.abs(x - 1.2) < 0.4) & (np.abs(y) < 0.2)] == FREE)


def test_a_leg_is_not_free_though_beams_pass_beside_it():
    """2 cm thick, 3 m away: two of eight keyframes see it, and all see through beside it."""
    leg = (3.02, 0.02, 0.55)
    beams = [level_fan(z) for z in (0.15, 0.95)] + [level_fan(0.55)] * 6
    grid = grid_of(walls(), [*beams, *[level_fan(0.55, leg)] * 2], GridConfig())
    x, y = centres(grid)
    off = np.hypot(x - leg[0], y - leg[1])
    assert grid.cells.ravel()[off.argmin()] == UNKNOWN
    assert np.all(grid.cells[(off > 0.1) & (x > 1.0) & (x < 5.5) & (np.abs(y) < 0.3)] == FREE)
    # Who walked by is seen once, and later seen through.
    grid = grid_of(walls(), [*beams, level_fan(0.55, leg)], GridConfig())
    assert grid.cells.ravel()[off.argmin()] == FREE


@pytest.mark.parametrize('y', [4.52, 4.97])
def test_a_leg_is_not_free_at_the_border_of_the_grid_either(y):
    """The border is at y = 5 m; beams pass the leg on both sides."""
    leg = (3.02, y, 0.55)
    passing = [(2.0 * leg[0], 2.0 * y + off, 0.0) for off in np.linspace(-0.6, 0.6, 61)]

    def fan(height, *more):
        return level_fan(height, [*((*each[:2], height) for each in passing), *more])

    beams = [fan(0.15), fan(0.95), *[fan(0.55)] * 6, *[fan(0.55, leg)] * 2]
    grid = grid_of(walls(), beams, GridConfig())
    x, y_of = centres(grid)
    assert grid.cells.ravel()[np.hypot(x - leg[0], y_of - y).argmin()] == UNKNOWN


def test_what_no_beam_crossed_is_not_free_though_the_lidar_moved_on():
    """The lidar sees the wall to its left from x = 0 and stands at x = 1 m at the end."""
    keyframes = []
    for height in (0.15, 0.55, 0.95):
        fan = level_fan(height)
        y = fan.cloud.points[:, 1]
        left = np.where(y > 0.0, -1.0, 0.0)[:, None] * (1.0, 0.0, 0.0)
        pose = fan.pose.copy()
        pose[0, 3] = 1.0
        points = fan.cloud.points - (1.0, 0.0, 0.0)
        keyframes.append(replace(fan, pose=pose, cloud=Seen(points, left)))
    x, y = centres(grid := grid_of(walls(), keyframes, GridConfig()))
    free = grid.cells == FREE
    inside, away = (x > 0.3) & (x < 5.5), np.hypot(x - 1.0, y) > 0.3
    # The border of what beams cross on the left is a line from x = 0, on the right from x = 1 m.
    for side, start in ((1.0, 0.0), (-1.0, 1.0)):
        border = 4.0 * (x - start) / (FAR - start)
        beside = inside & away & (side * y > 0.1)
        assert free[beside & (side * y < border - 0.1)].all()
        assert not free[beside & (side * y > border + 0.1)].any()


def test_where_the_robot_stood_is_free_and_not_where_its_lidar_was():
    """Below the lidar, 0.6 m ahead of the robot, is a hole."""
    across = np.arange(-0.2, 0.25, 0.05)
    x, y = (v.ravel() for v in np.meshgrid(across, across))
    fan = level_fan(1.0, np.column_stack([x, y, np.full(len(x), -1.0)]))
    keyframes = [level_fan(0.15), level_fan(0.55), fan]
    robot = planar(-0.6, 0.0, 0.0)
    grid = grid_of(walls(), [replace(each, robot=robot) for each in keyframes], GridConfig())
    x, y = centres(grid)
    assert (grid.cells[np.hypot(x, y) < 0.1] == UNKNOWN).all()
    assert (grid.cells[np.hypot(x + 0.6, y) < 0.1] == FREE).all()
