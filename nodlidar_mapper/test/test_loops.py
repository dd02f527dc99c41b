"""Loops: closed where enough of an old part of the map is seen again, and only there."""

from dataclasses import replace

from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import inverse, planar
from nodlidar_mapper.geometry.surface import surface_of
from nodlidar_mapper.graph.loops import loop_at
from nodlidar_mapper.graph.pose_graph import step
import numpy as np
import pytest
from rooms import cloud, CROOKED, keyframe_of, seen_from_origin

NOWHERE = np.empty((0, 3))
DRIFT = planar(0.12, -0.08, 0.02)  # of the map on the way round
SURE = np.diag([0.01**2] * 3 + [0.005**2] * 3)


@pytest.fixture
def way():
    """Return keyframes and edges of a way of 24 m that ends where it began, in the first room."""
    seen = seen_from_origin(cloud(CROOKED, np.eye(4), seed=1))
    room = surface_of(seen, seen)
    places = [(2.0 * k, 0.0) for k in range(6)] + [(12.0 - 2.0 * k, 0.5) for k in range(1, 7)]
    poses = [planar(x, y, 0.0) for x, y in places]
    poses[-1] = DRIFT
    keyframes = [keyframe_of(NOWHERE, pose, stamp_ns=k) for k, pose in enumerate(poses)]
    keyframes[0] = replace(keyframes[0], surface=room)
    edges = [
        step(k, k + 1, inverse(keyframes[k].pose) @ keyframes[k + 1].pose, SURE)
        for k in range(len(keyframes) - 1)
    ]
    return keyframes, edges


def test_a_room_that_is_seen_again_closes_the_loop(way):
    edge = loop_at(seen_from_origin(cloud(CROOKED, np.eye(4), seed=2)), *way, MapConfig())
    assert (edge.start, edge.end) == (0, len(way[0]) - 1)
    np.testing.assert_allclose(edge.relative, np.eye(4), atol=0.01)


def test_a_corner_of_it_does_not_close_the_loop(way):
    """It fits: but so little of a place may be another place, or the same one shifted."""
    seen = cloud(CROOKED, np.eye(4), seed=2)
    corner = seen[(seen[:, 0] > 3.0) & (seen[:, 1] < 0.0)]
    beyond = np.random.default_rng(1).uniform((20, 20, 0), (30, 30, 2), (4 * len(corner), 3))
    assert loop_at(seen_from_origin(np.concatenate([corner, beyond])), *way, MapConfig()) is None


def test_what_looks_alike_all_along_closes_no_loop(way):
    """A floor fits wherever it is; walls without an end do along them."""
    keyframes, edges = way
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-6.0, 6.0, (2, 8000))
    floor = np.column_stack([x, y, rng.normal(-1.0, 0.005, len(x))])
    walls = np.column_stack([x, np.copysign(1.5, y), y / 6.0])
    for points in (floor, walls):
        seen = seen_from_origin(points)
        keyframes[0] = replace(keyframes[0], surface=surface_of(seen, seen))
        here = seen_from_origin(points[np.abs(points[:, 0]) < 4.0])
        assert loop_at(here, keyframes, edges, MapConfig()) is None
