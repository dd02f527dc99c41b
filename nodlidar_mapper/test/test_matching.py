"""Clouds matched to surfaces whose true pose is known."""

from concurrent.futures import ProcessPoolExecutor
import math
from multiprocessing import get_context
import time

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_mapper.geometry.poses import corrected, inverse, matrix_from, moved, planar
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface, surface_of
from nodlidar_mapper.tracking.matching import FREEDOMS, match, MatchingConfig
import numpy as np
import pytest

WEAK = np.diag([1.0] * 6)
RNG = np.random.default_rng(1)


def wall(point, normal, span, up=2.5, count=1500):
    """Return random points on an upright wall from a point, along a span, facing a normal."""
    along, height = RNG.uniform(0.0, 1.0, (count, 1)), RNG.uniform(0.0, up, (count, 1))
    points = np.array([*point, 0.0]) + along * [*span, 0.0] + height * [0.0, 0.0, 1.0]
    return Surface(points, np.tile([*normal, 0.0], (count, 1)).astype(float))


ROOM = Surface.joined(
    [
        wall((-2.0, 2.0), (0, -1), (5.0, 0.0)),
        wall((-2.0, -1.5), (0, 1), (5.0, 0.0)),
        wall((3.0, -1.5), (-1, 0), (0.0, 3.5)),
        wall((-2.0, -1.5), (1, 0), (0.0, 3.5)),
        Surface(
            RNG.uniform([-2, -1.5, 0], [3, 2, 0], (1500, 3)), np.tile([0.0, 0.0, 1.0], (1500, 1))
        ),
    ]
)
CORRIDOR = Surface.joined(
    [wall((-20.0, side), (0, -side), (40.0, 0.0), count=20_000) for side in (1.0, -1.0)]
)

shifts = st.floats(-0.1, 0.1)


def seen_at(pose, points):
    """Return points of the map as seen from a pose, in its frame."""
    return seen_by_lidar(moved(inverse(pose), points))


def seen_by_lidar(points):
    """Return points in the frame of a robot as seen by a lidar 1 m above its origin."""
    return Seen(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))


@settings(max_examples=25)
@given(shifts, shifts, st.floats(-0.05, 0.05), st.floats(-math.pi, math.pi))
def test_a_cloud_is_found_from_nearby(dx, dy, turn, yaw):
    pose = planar(0.4, 0.1, yaw)
    cloud = seen_at(pose, ROOM.points[::3])
    guess = corrected(pose, np.array([dx, dy, 0.0, 0.0, 0.0, turn]))
    found = match(cloud, ROOM, guess, WEAK, MatchingConfig())
    np.testing.assert_allclose(found.pose, pose, atol=2e-4)
    assert found.share > 0.99


@settings(max_examples=25)
@given(st.floats(-math.pi, math.pi), st.floats(0.15, 0.3))
def test_wheels_that_slip_are_not_believed(direction, slip):
    """Odometry that is known to 6 mm went up to 50 times as far without the robot."""
    pose = planar(0.4, 0.1, 0.3)
    cloud = seen_at(pose, ROOM.points[::3])
    gone = slip * np.array([math.cos(direction), math.sin(direction)])
    guess = corrected(pose, np.array([*gone, 0.0, 0.0, 0.0, 0.0]))
    prior = np.diag([0.006**-2] * 3 + [0.005**-2] * 3)
    found = match(cloud, ROOM, guess, prior, MatchingConfig(), slip_time=0.0)
    np.testing.assert_allclose(found.pose, pose, atol=1e-3)
    # Student's t in 3 coordinates: the more standard deviations away, the less.
    assert found.prior_weight == pytest.approx(7.0 / (4.0 + (slip / 0.006) ** 2), rel=0.05)
    assert found.cost < match(cloud, ROOM, guess, prior, MatchingConfig()).cost
    assert found.on.mean() > 0.99
    assert match(cloud, ROOM, pose, prior, MatchingConfig(), slip_time=0.0).prior_weight == 1.0


@settings(max_examples=25)
@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.25), st.floats(0.1, 0.3))
def test_a_cloud_bent_by_wheels_that_slip_throughout_is_matched(direction, slip, turn):
    """Odometry shifted and turned the robot evenly for 0.7 s, while it stood."""
    pose = planar(0.4, 0.1, 0.3)
    truth = seen_at(pose, ROOM.points[::3]).points
    age = RNG.uniform(0.0, 1.0, len(truth))  # before 0.7 s ago, nothing slipped
    bent = []
    for point, share in zip(truth, np.minimum(age / 0.7, 1.0), strict=True):
        gone = slip * share * np.array([math.cos(direction), math.sin(direction)])
        back = inverse(planar(0.0, 0.0, turn * share))
        bent.append(moved(back, point[None] - [*gone, 0.0])[0])
    lidar = np.tile([0.0, 0.0, 1.0], (len(truth), 1))
    cloud = Seen(np.array(bent), lidar, age)
    gone = slip * np.array([math.cos(direction), math.sin(direction), 0.0])
    guess = pose @ matrix_from(planar(0.0, 0.0, turn)[:3, :3], gone)
    prior = np.diag([0.006**-2] * 3 + [0.005**-2] * 3)
    found = match(cloud, ROOM, guess, prior, MatchingConfig(), slip_time=0.7)
    np.testing.assert_allclose(found.pose, pose, atol=0.02)
    assert found.on.mean() > 0.9
    assert found.cost < match(cloud, ROOM, guess, prior, MatchingConfig(), slip_time=0.0).cost


@settings(max_examples=10)
@given(st.tuples(*[st.floats(-0.04, 0.04)] * 6))
def test_all_six_coordinates_are_found_if_they_are_free(change):
    pose = planar(0.4, 0.1, 0.3)
    cloud = seen_at(pose, ROOM.points[::3])
    guess = corrected(pose, np.array(change))
    found = match(cloud, ROOM, guess, WEAK, MatchingConfig(freedom='spatial'))
    np.testing.assert_allclose(found.pose, pose, atol=5e-4)
    kept = match(cloud, ROOM, guess, WEAK, MatchingConfig()).pose
    np.testing.assert_allclose(kept[2, 3], guess[2, 3])


def test_along_a_corridor_the_position_stays_that_of_odometry():
    cloud = seen_by_lidar(CORRIDOR.points[np.abs(CORRIDOR.points[:, 0]) < 5.0])
    guess = planar(0.3, 0.05, 0.02)
    found = match(cloud, CORRIDOR, guess, np.diag([1e4] * 6), MatchingConfig())
    assert abs(found.pose[0, 3] - 0.3) < 0.02
    assert abs(found.pose[1, 3]) < 1e-3
    assert found.information[0, 0] < 1e-3 * found.information[1, 1]


def bowl(seed):
    """Return a floor as a lidar sees it that measures too short far away: it rises around it."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-3.5, 3.5, (2, 3000))
    points = np.column_stack([x, y, 0.004 * (x**2 + y**2) + rng.normal(0.0, 0.01, len(x))])
    return seen_by_lidar(points)


@pytest.mark.parametrize(('freedom', 'shown'), [('planar', 0), ('spatial', 3)])
def test_over_a_bare_floor_the_robot_is_where_odometry_says(freedom, shown):
    """The floor seems to come along with it, and noise turns the normals of the map."""
    surface = surface_of(bowl(1), bowl(1))
    guess, known = planar(0.2, 0.1, 0.1), np.diag([0.05**-2] * 3 + [0.05**-2] * 3)
    found = match(bowl(2), surface, guess, known, MatchingConfig(freedom=freedom))
    assert found.share > 0.95
    np.testing.assert_allclose(found.pose[:2, 3], guess[:2, 3], atol=0.005)
    assert abs(np.arctan2(found.pose[1, 0], found.pose[0, 0]) - 0.1) < 0.002
    assert found.shown(FREEDOMS[freedom]) == shown


def test_the_surfaces_show_as_many_directions_as_they_have():
    free = FREEDOMS['planar']
    for surface, shown in ((ROOM, free), (CORRIDOR, free[1:])):
        cloud = seen_by_lidar(surface.points[np.abs(surface.points[:, 0]) < 5.0])
        found = match(cloud, surface, np.eye(4), np.diag([1e4] * 6), MatchingConfig())
        assert found.shown(free) == len(shown)
        assert [k for k in free if found.information[k, k] > 25.0] == shown


def test_at_the_border_of_the_map_a_cloud_still_fits():
    """All its points are 0.25 to 0.35 m beyond the surface, which the search leaves in the end."""
    surface = wall((0.0, 1.0), (0, -1), (5.0, 0.0))
    beyond = wall((5.25, 1.0), (0, -1), (0.1, 0.0), count=200)
    guess = corrected(np.eye(4), np.array([0.0, 0.02, 0.0, 0.0, 0.0, 0.0]))
    found = match(seen_at(np.eye(4), beyond.points), surface, guess, WEAK, MatchingConfig())
    assert found.share > 0.99
    assert abs(found.pose[1, 3]) < 0.015  # nearer than the guess


def test_a_cloud_of_somewhere_else_does_not_fit():
    cloud = seen_by_lidar(RNG.uniform(-3.0, 3.0, (2000, 3)))
    assert match(cloud, ROOM, planar(0, 0, 0), WEAK, MatchingConfig()).share < 0.4
    there = Seen(cloud.points + 100.0, cloud.origins + 100.0)
    far = match(there, ROOM, planar(0, 0, 0), WEAK, MatchingConfig())
    assert far.share == 0.0
    np.testing.assert_array_equal(far.pose, planar(0, 0, 0))


def test_the_other_side_of_a_wall_is_not_matched():
    """The robot has left the room and sees its wall from outside: that is news, and no shift."""
    thickness = 0.1
    room = Surface.joined(
        [wall((-4.0, side), (0, -side), (4.0, 0.0)) for side in (2.0, -2.0)]
        + [wall((0.0, -2.0), (-1, 0), (0.0, 4.0))]
    )
    outside = wall((thickness, -1.5), (1, 0), (0.0, 3.0))
    pose = planar(1.5, 0.0, 0.2)
    found = match(seen_at(pose, outside.points), room, pose, WEAK, MatchingConfig())
    assert found.near_share == 0.0
    np.testing.assert_array_equal(found.pose, pose)
    seen = Seen(outside.points, np.tile(pose[:3, 3], (len(outside.points), 1)))
    assert not room.covers(seen, thickness + 0.02).any()


@pytest.mark.parametrize('thickness', [0.02, 0.06, 0.1])
def test_both_sides_of_a_wall_are_surfaces(thickness):
    """Each side was seen by a lidar of its own; neighbours of the other side do not count."""
    left = wall((0.0, -2.0), (-1, 0), (0.0, 4.0)).points
    right = wall((thickness, -2.0), (1, 0), (0.0, 4.0)).points
    lidars = np.repeat([[-2.0, 0.0, 1.0], [2.0, 0.0, 1.0]], len(left), axis=0)
    seen = Seen(np.concatenate([left, right]), lidars)
    surface = surface_of(seen, seen)
    assert len(surface.points) > 0.8 * len(seen.points)
    faces_left = surface.normals[:, 0] < 0.0
    true = np.where(faces_left, 0.0, thickness)
    assert np.mean(np.abs(surface.points[:, 0] - true) < 1e-6) > 0.95
    assert np.mean(faces_left) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize('radius', [0.25, 0.4, 1.0, 10.0])
def test_what_is_seen_of_a_pillar_lies_on_it(radius):
    """Points in rows with 10 mm of noise; a plane through neighbours would be inside of it."""
    rng = np.random.default_rng(1)
    angle = rng.uniform(-1.0, 1.0, 120) * min(1.0, 0.5 / radius)
    away = radius + rng.normal(0.0, 0.01, len(angle))
    height = 0.15 * rng.integers(0, 10, len(angle))
    points = np.column_stack([away * np.cos(angle), away * np.sin(angle), height])
    seen = Seen(points, np.tile([radius + 4.0, 0.0, 1.0], (len(points), 1)))
    surface = surface_of(seen.thinned(0.1), seen)
    assert len(surface.points) > 50
    x, y, _ = surface.points.T
    assert abs(np.mean(np.hypot(x, y)) - radius) < 0.004
    turned = np.arctan2(surface.normals[:, 1], surface.normals[:, 0]) - np.arctan2(y, x)
    assert np.sqrt(np.mean(turned**2)) < 0.15


def processor_times_of_ten_matches():
    """Return the processor time [s] of all threads and of this one."""
    cloud = seen_at(planar(0.0, 0.0, 0.1), CORRIDOR.points[::4])
    of_all, of_this = time.process_time(), time.thread_time()
    for _ in range(10):
        match(cloud, CORRIDOR, planar(0.05, 0.02, 0.1), WEAK, MatchingConfig())
    return time.process_time() - of_all, time.thread_time() - of_this


def test_one_thread_matches_a_large_cloud(monkeypatch):
    monkeypatch.delenv('OPENBLAS_NUM_THREADS', raising=False)  # `make test` sets it
    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as a_new_process:
        of_all, of_this = a_new_process.submit(processor_times_of_ten_matches).result()
    assert of_all < 1.1 * of_this
