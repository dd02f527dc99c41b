"""A map that begins with a part of a sweep, as when the nod begins, of a robot that stands."""

from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output.grid import FREE, grid_of, GridConfig
from nodlidar_mapper.output.lasting import lasting_surface
import numpy as np
import pytest
from rooms import cloud, CROOKED, distance_inside

NS = 10**9
RADIUS, HEIGHT, AWAY = 0.25, 0.5, 1.5  # of a person, above whom walls are seen, and how far away


def part(points, share=0.1):
    """Return the points in a share of all directions, ahead."""
    return points[np.abs(np.arctan2(points[:, 1], points[:, 0])) < share * np.pi]


def stand(*clouds):
    mapper = Mapper(MapConfig())
    for k, points in enumerate(clouds):
        mapper.add(Cloud(k * NS, points, np.eye(4)))
    return mapper


def free_share(mapper):
    """Return the share of the floor that is free, but for what is next to the walls."""
    grid = grid_of(lasting_surface(mapper.map.keyframes), mapper.map.keyframes, GridConfig())
    rows, columns = np.indices(grid.cells.shape)
    cells = np.stack([columns, rows], axis=-1) + 0.5
    middles = np.array(grid.origin) + grid.resolution * cells.reshape(-1, 2)
    inside = distance_inside(CROOKED, middles) > 0.3
    return np.mean(grid.cells.ravel()[inside] == FREE)


@pytest.mark.parametrize('share', [0.0, 0.01, 0.1, 0.3])
def test_all_that_a_robot_sees_is_free_although_it_stands(share):
    clouds = [cloud(CROOKED, np.eye(4), seed=k) for k in range(8)]
    first = part(clouds[0], share)
    for count in (3, 8):  # before the first clouds are mapped again, and after that
        assert free_share(stand(first, *clouds[1:count])) > 0.9
    assert free_share(stand(*clouds)) > 0.9


def test_a_robot_that_stands_adds_a_few_keyframes_however_much_its_clouds_differ():
    """Each has more than twice as many points as the one before it."""
    counts = np.geomspace(50, 4000, 60).astype(int)
    clouds = [cloud(CROOKED, np.eye(4), k, n) for k, n in enumerate(counts)]
    mapper = stand(*clouds)
    assert len(mapper.map.keyframes) <= 1 + np.log2(4000 / 50)
    keyframes = len(mapper.map.keyframes), mapper.map.points
    for k, points in enumerate(clouds):
        mapper.add(Cloud((100 + k) * NS, points, np.eye(4)))
    assert len(mapper.map.keyframes) == keyframes[0]
    assert mapper.map.points < 1.1 * keyframes[1]


def with_person(points, y, seed):
    """Return a cloud with a person, who hides what is behind."""
    beam = np.arctan2(points[:, 1], points[:, 0]) - np.arctan2(y, AWAY)
    distance, ranges = np.hypot(AWAY, y), np.hypot(points[:, 0], points[:, 1])
    hidden = np.abs(np.sin(beam)) < RADIUS / distance
    hidden &= (points[:, 0] > 0.0) & (points[:, 2] * distance < HEIGHT * ranges)
    rng = np.random.default_rng(seed)
    side = np.arctan2(y, AWAY) + np.pi + rng.uniform(-1.4, 1.4, 600)
    height = rng.uniform(0.0, HEIGHT, 600)
    around = RADIUS * np.stack([np.cos(side), np.sin(side)], axis=1)
    return np.concatenate(
        [points[~hidden], np.column_stack([around + np.array([AWAY, y]), height])]
    )


def test_a_person_who_walks_by_meanwhile_leaves_no_wall():
    mapper, there = Mapper(MapConfig()), []
    for k in range(20):
        pose = planar(max(0.25 * (k - 8), 0.0), 0.0, 0.0)
        points = cloud(CROOKED, pose, seed=k)
        if k < 8:
            points = with_person(points, 0.4 * k - 1.5, k)
        mapper.add(Cloud(k * NS, part(points) if k == 0 else points, pose))
        lasting = lasting_surface(mapper.map.keyframes).points
        there.append((distance_inside(CROOKED, lasting) > 0.3).sum())
    assert max(there) > 20
    assert there[-1] == 0
