import math

from nodlidar_common.nod import Nod
from nodlidar_sim.world.nod_motion import PiecewiseMotion, triangle_motion
from nodlidar_sim.world.route import Plan
from nodlidar_sim.world.scene import load_scene, parse_scene
from nodlidar_sim.world.world import World
import numpy as np
import pytest

S = 1_000_000_000
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 0)
WALL = 'objects: {wall: {shapes: [{plane: {point: [2, 0, 0], normal: [1, 0, 0]}}]}}\n'
MOUNTED = WALL + 'sensor: {mount: [0.1, -0.2, 0.9, 0.02, 0.1, 0.3]}\n'
BASE_START, BASE_VELOCITY = (0.3, 0.2, -0.4), (0.5, 0.7)


def still(pitch):
    return PiecewiseMotion(np.array([0]), np.array([pitch]), np.zeros(1), np.zeros(1))


def test_level_beams_meet_a_wall_at_the_secant():
    azimuth = np.array([-1.0, 0.0, 0.5])
    ranges = World(parse_scene(WALL, 'w'), still(0.0)).ranges(np.zeros(3, dtype=int), azimuth)
    np.testing.assert_allclose(ranges, 2.0 / np.cos(azimuth))


@pytest.mark.parametrize('pitch', [-0.5, 0.3])
def test_the_lever_arm_moves_the_optical_centre_back_when_pitched_up(pitch):
    """At x = 2 = r cos(pitch) - z_off sin(pitch), straight ahead."""
    ranges = World(parse_scene(WALL, 'w'), still(pitch)).ranges(
        np.zeros(1, dtype=int), np.zeros(1)
    )
    assert ranges[0] == pytest.approx((2.0 + 0.08 * math.sin(pitch)) / math.cos(pitch))


def test_positive_pitch_is_up():
    _, up = World(load_scene('room', ideal=True), still(0.4)).rays(
        np.zeros(1, dtype=int), np.zeros(1)
    )
    np.testing.assert_allclose(up, [[math.cos(0.4), 0.0, math.sin(0.4)]])


def scalar_ray(world, time_ns, azimuth):
    """Chain homogeneous matrices for one beam: world <- base <- mount <- tilt <- laser."""

    def matrix(rotation, position):
        whole = np.eye(4)
        whole[:3, :3], whole[:3, 3] = rotation, position
        return whole

    def about(axis, angle):
        c, s = math.cos(angle), math.sin(angle)
        first, second = [(1, 2), (2, 0), (0, 1)][axis]
        rotation = np.eye(3)
        rotation[[first, second], [first, second]] = c
        rotation[first, second], rotation[second, first] = -s, s
        return rotation

    elapsed = time_ns / S
    (x, y, yaw), (speed, rate) = BASE_START, BASE_VELOCITY
    radius = speed / rate
    heading = yaw + rate * elapsed
    x += radius * (math.sin(heading) - math.sin(yaw))
    y -= radius * (math.cos(heading) - math.cos(yaw))
    pitch = float(world.motion.position(np.array([time_ns]))[0])
    chain = (
        matrix(about(2, heading), [x, y, 0.0])
        @ matrix(about(2, 0.3) @ about(1, 0.1) @ about(0, 0.02), [0.1, -0.2, 0.9])
        @ matrix(about(1, -pitch), [0.0, 0.0, 0.0])
        @ matrix(np.eye(3), [0.0, 0.0, 0.08])
    )
    return chain[:3, 3], chain[:3, :3] @ [math.cos(azimuth), math.sin(azimuth), 0.0]


def moving_world(scene):
    end_ns = 3 * S
    base = Plan(BASE_VELOCITY).route(BASE_START, 0)
    return World(scene, triangle_motion(NOD, 0, end_ns), base)


def test_every_beam_has_the_pose_of_its_own_instant():
    """Rolling shutter: the vectorised rays against one chain of matrices per beam."""
    world = moving_world(parse_scene(MOUNTED, 'w'))
    times = np.linspace(0, 2 * S, 200).astype(np.int64)
    azimuth = np.linspace(-2.0, 2.0, 200)
    origins, directions = world.rays(times, azimuth)
    for i in range(200):
        origin, direction = scalar_ray(world, int(times[i]), azimuth[i])
        np.testing.assert_allclose(origins[i], origin, atol=1e-9)
        np.testing.assert_allclose(directions[i], direction, atol=1e-9)
        along = (2.0 - origin[0]) / direction[0]
        expected = along if along > 0.0 else math.inf
        assert world.ranges(times[[i]], azimuth[[i]])[0] == pytest.approx(expected, abs=1e-7)


def test_what_is_seen_at_once_or_beam_by_beam_is_the_same():
    world = moving_world(load_scene('room', ideal=True))
    times = np.arange(682) * 97656
    azimuth = np.linspace(-2.0, 2.0, 682)
    one_by_one = [world.ranges(times[[i]], azimuth[[i]])[0] for i in range(0, 682, 11)]
    np.testing.assert_allclose(world.ranges(times, azimuth)[::11], one_by_one, rtol=1e-12)


def test_points_by_the_model_lie_on_the_surfaces():
    """The beam's end in nodlidar_base_link, by its formula, is in the frame of that instant."""
    world = moving_world(load_scene('room', ideal=True))
    times = np.linspace(0, 2 * S, 500).astype(np.int64)
    theta = np.linspace(-2.0, 2.0, 500)
    r, phi = world.ranges(times, theta), world.motion.position(times)
    x = r * np.cos(theta) * np.cos(phi) - 0.08 * np.sin(phi)
    z = r * np.cos(theta) * np.sin(phi) + 0.08 * np.cos(phi)
    points = np.stack([x, r * np.sin(theta), z], axis=1)
    assert world.surface_distance(points, times).max() < 1e-9
    assert world.surface_distance(points, times[:1]).max() > 0.1


PERSON = """
  person:
    pose: [1.0, -0.5, 0.1, 0.2, 0.1, 1.2]
    motion: {legs: [{duration: 0.7, velocity: [1.2, 0.0]}], velocity: [0.8, 0.9]}
    shapes:
      - cylinder: {pose: [0.1, 0.0, 0.9, 0.0, 0.0, 0.0], radius: 0.2, length: 1.8}
      - box: {pose: [0.0, 0.3, 1.2, 0.0, 0.0, 0.5], size: [0.2, 0.2, 0.8]}
"""


def frozen(x, y, yaw):
    """Return the person as an object that stands where it is at one instant."""
    text = PERSON.replace('[1.0, -0.5, 0.1, 0.2, 0.1, 1.2]', f'[{x}, {y}, 0.1, 0.2, 0.1, {yaw}]')
    return ''.join(line for line in text.splitlines(True) if 'motion' not in line)


def test_each_beam_meets_who_walks_where_that_is_at_its_instant():
    """Beam by beam, against scenes in which the person stands; both drive and nod."""
    objects = WALL.replace('{wall: {', '\n  wall: {').removesuffix('}\n') + PERSON
    base, motion = Plan(BASE_VELOCITY).route(BASE_START, S), triangle_motion(NOD, 0, 5 * S)
    world = World(parse_scene(objects, 'w'), motion, base, start_ns=S)
    times = np.linspace(S, 3 * S, 120).astype(np.int64)
    azimuth = np.tile(np.linspace(-0.6, 0.6, 8), 15)
    ranges = world.ranges(times, azimuth)
    person = world.scene.movers['person']
    walked = person.plan.route(person.start, S).poses(times)
    stood = WALL.replace('{wall: {', '\n  wall: {').removesuffix('}\n')
    expected = [
        World(parse_scene(stood + frozen(*map(float, pose)), 'w'), motion, base).ranges(
            times[[i]], azimuth[[i]]
        )[0]
        for i, pose in enumerate(walked)
    ]
    np.testing.assert_allclose(ranges, expected, atol=1e-9)
    alone = World(parse_scene(WALL, 'w'), motion, base).ranges(times, azimuth)
    assert 20 < (ranges < alone - 0.05).sum() < 100
    np.testing.assert_array_less(ends_apart(world, times, azimuth, ranges), 1e-9)


def ends_apart(world, times, azimuth, ranges):
    """Return how far the beams' ends are from the surfaces, as they are at the beams' times."""
    phi = world.motion.position(times)
    level = ranges * np.cos(azimuth)
    x, z = level * np.cos(phi) - 0.08 * np.sin(phi), level * np.sin(phi) + 0.08 * np.cos(phi)
    hit = np.isfinite(ranges)
    points = np.stack([x, ranges * np.sin(azimuth), z], axis=1)
    return world.surface_distance(points[hit], times[hit])


def test_who_crosses_is_seen_at_walking_pace():
    """A column of 0.2 m radius crosses 1.5 m ahead at 1.2 m/s: its edges by trigonometry."""
    column = """
  column:
    pose: [1.5, -1.2, 0, 0, 0, 1.5707963267948966]
    motion: {velocity: [1.2, 0]}
    shapes: [{cylinder: {pose: [0, 0, 1, 0, 0, 0], radius: 0.2, length: 2}}]
"""
    world = World(parse_scene('objects:' + column, 'c'), still(0.0))
    times = np.arange(0, 2 * S, S // 1000)
    hit = np.isfinite(world.ranges(times, np.zeros(len(times))))
    assert (times[hit][0] / S, times[hit][-1] / S) == pytest.approx(
        (1.0 / 1.2, 1.4 / 1.2), abs=1e-3
    )
    middle = world.ranges(np.array([S]), np.zeros(1))
    assert middle[0] == pytest.approx(1.3)


def test_without_a_base_of_its_own_a_world_takes_the_route_of_the_scene():
    scene = load_scene('corridor', ideal=True)
    world = World(scene, still(0.0))
    np.testing.assert_allclose(world.base.poses(np.array([2 * S])), [[0.6, 0.0, 0.0]])
