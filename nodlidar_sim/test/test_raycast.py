from nodlidar_common.pose import Pose
from nodlidar_sim.world.raycast import surfaces_of
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.shapes import Box, Plane, Sphere
import numpy as np
import pytest


def random_rays(count, seed=0):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return rng.uniform([-3.0, -2.5, 0.1], [3.0, 2.5, 2.4], (count, 3)), directions


@pytest.fixture(scope='module')
def room():
    return load_scene('room', ideal=True)


def all_shapes(scene):
    return [shape for shapes in scene.objects.values() for shape in shapes]


def test_every_ray_gets_to_the_first_of_all_surfaces(room):
    """Each shape is asked about every ray here: none is lost with the rays that are left out."""
    origins, directions = random_rays(20000)
    alone = [shape.intersect(origins.T, directions.T) for shape in all_shapes(room)]
    found = room.surfaces.distances(origins, directions)
    np.testing.assert_array_equal(found, np.min(alone, axis=0))
    assert len(np.unique(np.argmin(alone, axis=0))) == len(alone)


def test_a_ray_that_touches_the_bounding_sphere_still_meets_the_corner_of_a_box():
    box = Box(Pose(np.zeros(3), np.eye(3)), np.array([2.0, 2.0, 2.0]))
    corner = np.ones(3)
    origin = np.array([1.0, 5.0, -3.0])
    direction = (corner * (1.0 - 1e-9) - origin) / np.linalg.norm(corner - origin)
    hit = surfaces_of([box]).distances(origin[None], direction[None])
    assert hit[0] == pytest.approx(np.linalg.norm(corner - origin))


def test_a_ray_from_within_a_solid_meets_its_far_wall():
    surfaces = surfaces_of([Sphere(np.array([1.0, 0.0, 0.0]), 2.0)])
    hits = surfaces.distances(np.zeros((2, 3)), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(hits, [3.0, 1.0])


def test_hits_lie_on_a_surface_of_the_scene(room):
    origins, directions = random_rays(5000)
    hits = room.surfaces.distances(origins, directions)
    ends = origins + hits[:, None] * directions
    assert room.surfaces.surface_distance(ends).max() < 1e-9


def test_the_distance_is_that_to_the_nearest_of_all_surfaces(room):
    points, _ = random_rays(2000, seed=1)
    alone = [shape.distance(points.T) for shape in all_shapes(room)]
    np.testing.assert_array_equal(room.surfaces.surface_distance(points), np.min(alone, axis=0))


def test_where_nothing_is_a_ray_ends_nowhere():
    origins, directions = random_rays(10)
    assert np.isinf(surfaces_of([]).distances(origins, directions)).all()
    assert np.isinf(surfaces_of([]).surface_distance(origins)).all()


def test_no_rays_give_no_distances():
    surfaces = surfaces_of(
        [Plane(np.zeros(3), np.array([0.0, 0.0, 1.0])), Sphere(np.ones(3), 1.0)]
    )
    none = np.empty((0, 3))
    assert surfaces.distances(none, none).shape == (0,)
    assert surfaces.surface_distance(none).shape == (0,)
