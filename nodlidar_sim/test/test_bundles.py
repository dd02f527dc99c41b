"""Solids that are out of view are left out, and nothing that a ray meets is."""

from dataclasses import dataclass, replace
import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_sim.world import raycast
from nodlidar_sim.world.bundles import bundled, Bundles, RAYS
from nodlidar_sim.world.moving import Mover
from nodlidar_sim.world.nod_motion import triangle_motion
from nodlidar_sim.world.planar import rotate, to_child
from nodlidar_sim.world.raycast import surfaces_of
from nodlidar_sim.world.route import Leg, Plan
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.shapes import Box, Cylinder, Plane, Sphere
from nodlidar_sim.world.world import World
import numpy as np
import pytest

S = 1_000_000_000
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 0)
SENSOR = SensorModel()
seeds = st.integers(0, 2**32 - 1)


def scans(count, start_ns=0):
    """Return the times and azimuths of the beams of some scans."""
    times = SENSOR.beam_times_ns(start_ns, count, 1.0)
    return times.ravel(), np.tile(SENSOR.azimuth, count)


def random_shape(rng):
    pose = Pose.from_xyzrpy([*rng.uniform(-4.0, 4.0, 3), *rng.uniform(-np.pi, np.pi, 3)])
    kinds = {
        'plane': lambda: Plane(pose.position, pose.rotation[0]),
        'sphere': lambda: Sphere(pose.position, rng.uniform(0.02, 2.0)),
        'box': lambda: Box(pose, rng.uniform(0.02, 2.0, 3)),
        'cylinder': lambda: Cylinder(pose, *rng.uniform(0.02, 1.5, 2)),
    }
    return kinds[rng.choice(list(kinds), p=[0.1, 0.3, 0.3, 0.3])]()


def random_plan(rng):
    legs = [Leg(rng.uniform(0.1, 2.0), tuple(rng.uniform(-2.0, 2.0, 2))) for _ in range(3)]
    return Plan(legs=tuple(legs), repeat=True)


def random_world(rng):
    """Return a world of shapes, things that move, and a base that does, from 1 s on."""
    shapes = tuple(random_shape(rng) for _ in range(12))
    movers = {
        str(number): Mover(
            tuple(random_shape(rng) for _ in range(3)),
            tuple(rng.uniform(-4.0, 4.0, 3)),
            random_plan(rng),
        )
        for number in range(3)
    }
    scene = replace(
        load_scene('wall', ideal=True),
        objects={'it': shapes},
        surfaces=surfaces_of(shapes),
        movers=movers,
    )
    route = random_plan(rng).route(rng.uniform(-2.0, 2.0, 3), S)
    return World(scene, triangle_motion(NOD, 0, 5 * S), route, S)


def ranges_with_all_in_view(world, times, azimuth):
    """Ask every shape about every ray."""
    origins, directions = world.rays(times, azimuth)
    found = [shape.intersect(origins.T, directions.T) for shape in world.scene.objects['it']]
    for mover in world.scene.movers.values():
        poses = mover.plan.route(mover.start, S).poses(times)
        own = to_child(origins, poses).T, rotate(directions, -poses[:, 2]).T
        found += [shape.intersect(*own) for shape in mover.shapes]
    return np.min(found, axis=0)


@settings(max_examples=60)
@given(seeds)
def test_no_beam_loses_what_it_meets(seed):
    """Scenes of any shapes, any moving objects, and a base that drives while it nods."""
    world = random_world(np.random.default_rng(seed))
    times, azimuth = scans(3, S // 2)
    expected = ranges_with_all_in_view(world, times, azimuth)
    np.testing.assert_allclose(world.ranges(times, azimuth), expected, rtol=1e-12)


def outward(vector, way):
    """Return the direction across a way to which a vector points."""
    across = vector - (vector @ way) * way
    length = np.linalg.norm(across)
    return across / length if length > 1e-12 else np.linalg.svd(way[None])[2][1]


@settings(max_examples=300)
@given(seeds, st.sampled_from([0.0, 1e-9, 1e-3, 0.5]), st.sampled_from([0.0, 1e-6, 0.1, 1.0, 9.0]))
def test_a_ball_that_only_the_outermost_ray_touches_is_in_view(seed, spread, fan):
    """Starts and ways of any spread; the ball touches one ray, from the side off the axis."""
    rng = np.random.default_rng(seed)
    starts = rng.normal(size=(3, 1)) + spread * rng.normal(size=(3, RAYS))
    ways = rng.normal(size=(3, 1)) + fan * rng.normal(size=(3, RAYS))
    ways /= np.linalg.norm(ways, axis=0)
    middle = RAYS // 2
    turned = fan >= spread
    apart = (ways - ways[:, [middle]]) if turned else (starts - starts[:, [middle]])
    outermost = np.linalg.norm(apart, axis=0).argmax()
    way, radius = ways[:, outermost], rng.uniform(0.01, 2.0)
    side = outward(apart[:, outermost], way)
    touched = starts[:, outermost] + rng.uniform(0.5, 5.0) * way
    ball = Sphere(touched + (1.0 - 1e-9) * radius * side, radius)
    assert np.isfinite(ball.intersect(starts, ways))[outermost]
    bundles = Bundles(starts, ways)
    assert bundles.in_view(ball.center[:, None, None], np.array([[radius]])).all()


def test_who_runs_past_a_bundle_in_no_time_is_met_by_the_beam_that_it_crosses():
    """At 300 m/s; in the 3 ms of a bundle it covers 0.9 m, and crosses one beam or two."""
    runner = Mover((Sphere(np.array([0.0, 0.0, 1.0]), 0.05),), (2.0, 0.0, 0.0), Plan((300.0, 0.0)))
    moving = runner.moving(0)
    times = np.arange(RAYS) * 100_000
    along = 300.0 * times / S  # where it then is
    for crossed in range(RAYS):
        origins = np.tile([2.0 + along[crossed], -3.0, 1.0], (RAYS, 1))
        hits = moving.distances(origins, np.tile([0.0, 1.0, 0.0], (RAYS, 1)), times)
        apart = np.minimum(np.abs(along - along[crossed]), 0.05)
        expected = np.where(apart < 0.05, 3.0 - np.sqrt(0.05**2 - apart**2), np.inf)
        np.testing.assert_allclose(hits, expected)


@dataclass
class Counted:
    """A solid that counts the rays that it is asked about."""

    solid: Sphere
    rays: int = 0

    @property
    def center(self):
        return self.solid.center

    @property
    def bounding_radius(self):
        return self.solid.bounding_radius

    def intersect(self, origins, directions):
        self.rays += origins.shape[1]
        return self.solid.intersect(origins, directions)

    def distance(self, points):
        return self.solid.distance(points)


def counted_room():
    room = load_scene('room', ideal=True)
    objects = {
        name: tuple(s if isinstance(s, Plane) else Counted(s) for s in shapes)
        for name, shapes in room.objects.items()
    }
    shapes = [shape for shapes in objects.values() for shape in shapes]
    return replace(room, objects=objects, surfaces=surfaces_of(shapes)), [
        shape for shape in shapes if isinstance(shape, Counted)
    ]


def test_in_the_room_a_beam_is_tried_on_few_of_its_solids():
    """In two sweeps, almost: a solid is in view of a bundle in forty."""
    scene, solids = counted_room()
    times, azimuth = scans(8)
    World(scene, triangle_motion(NOD, 0, S)).ranges(times, azimuth)
    assert len(solids) == 28
    assert 0 < sum(solid.rays for solid in solids) < 0.05 * len(solids) * len(times)


@pytest.mark.parametrize(('azimuth', 'share'), [(0.0, 2.0), (2.0, 2.0), (math.pi, 0.0)])
def test_only_beams_around_a_ball_are_tried_on_it(azimuth, share):
    """It appears within 0.05 rad; URG beams end at 2.09 rad, and so see nothing behind."""
    center = np.array([2.0 * math.cos(azimuth), 2.0 * math.sin(azimuth), 0.1])
    ball = Counted(Sphere(center, 0.1))
    origins = np.zeros((682, 3))
    directions = np.stack([np.cos(SENSOR.azimuth), np.sin(SENSOR.azimuth), np.zeros(682)], axis=1)
    hit = np.isfinite(surfaces_of([ball]).distances(origins, directions))
    assert hit.sum() <= ball.rays <= hit.sum() + share * 2 * RAYS


def test_who_walks_out_of_view_is_not_tried_at_all():
    walker = Counted(Sphere(np.array([0.0, 0.0, 1.0]), 0.3))
    mover = Mover((walker,), (-3.0, 0.0, 0.0), Plan((0.1, 0.0)))
    scene = replace(load_scene('wall', ideal=True), movers={'walker': mover})
    World(scene, triangle_motion(NOD, 0, S)).ranges(*scans(4))
    assert walker.rays == 0


def test_a_scene_of_planes_needs_no_bundles(monkeypatch):
    monkeypatch.setattr(raycast, 'Bundles', None)
    times, azimuth = scans(1)
    ranges = World(load_scene('wall', ideal=True), triangle_motion(NOD, 0, S)).ranges(
        times, azimuth
    )
    assert np.isfinite(ranges).any()


@pytest.mark.parametrize('count', [0, 1, RAYS, RAYS + 1])
def test_bundles_are_filled_up_with_the_last_ray(count):
    numbers = bundled(np.arange(count))
    assert numbers.shape == (math.ceil(count / RAYS), RAYS)
    expected = np.minimum(np.arange(numbers.size), count - 1)
    np.testing.assert_array_equal(numbers.ravel(), expected)
