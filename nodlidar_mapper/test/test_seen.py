"""Points of clouds as the lidar saw them."""

from nodlidar_mapper.geometry.seen import Seen
import numpy as np

NOISE = 0.01  # m


def corridor():
    """Return scans of the two walls of a corridor ahead, in the order of beams, with noise."""
    rng = np.random.default_rng(1)
    azimuth = np.concatenate([np.arange(-1.2, -0.2, 0.006), np.arange(0.2, 1.2, 0.006)])
    scans = []
    for height in np.arange(-2.0, 2.0, 0.05):
        off = rng.normal(0.0, NOISE, len(azimuth))
        ranges = 1.05 / np.abs(np.sin(azimuth)) + off
        x, y = ranges * np.cos(azimuth), ranges * np.sin(azimuth)
        scans.append(np.column_stack([x, y, np.full_like(x, height)]))
    points = np.concatenate(scans)
    return Seen(points, np.zeros_like(points))


def test_one_point_of_each_cube_is_left():
    thinned = corridor().thinned(0.1)
    cubes = np.floor(thinned.points / 0.1)
    assert len(np.unique(cubes, axis=0)) == len(cubes)
    assert len(cubes) == len(np.unique(np.floor(corridor().points / 0.1), axis=0))


def test_what_is_left_of_a_corridor_lies_on_its_walls_on_average():
    """Both walls would move to the right by 1 mm if the first point of each cube was left."""
    y = corridor().thinned(0.1).points[:, 1]
    for side in (-1.0, 1.0):
        off = side * y[np.sign(y) == side] - 1.05
        assert abs(off.mean()) < 3.0 * NOISE / np.sqrt(len(off))
