import math

from hypothesis import assume, given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.pose import Pose
from nodlidar_sim.world.shapes import Box, Cylinder, Plane, Sphere
import numpy as np
import pytest

coordinates = st.floats(-5.0, 5.0)
sizes = st.floats(0.05, 3.0)
angles = st.floats(-math.pi, math.pi)
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)
poses = st.tuples(*[coordinates] * 3, *[angles] * 3).map(Pose.from_xyzrpy)


def unit(vector):
    length = np.linalg.norm(vector)
    return vector / length if length > 1e-3 else np.array([0.6, 0.0, 0.8])


directions = points.map(unit)
planes = st.builds(Plane, points, directions)
spheres = st.builds(Sphere, points, sizes)
boxes = st.builds(Box, poses, st.tuples(sizes, sizes, sizes).map(np.array))
cylinders = st.builds(Cylinder, poses, sizes, sizes)
shapes = st.one_of(planes, spheres, boxes, cylinders)


@st.composite
def rays(draw, kinds):
    """Return a shape, an origin anywhere, and a direction that leads close to the shape."""
    shape, origin = draw(kinds), draw(points)
    middle = shape.point if isinstance(shape, Plane) else shape.center
    return shape, origin, unit(middle + draw(points) / 5.0 - origin)


def first_hit(shape, origin, direction):
    return float(shape.intersect(origin[:, None], direction[:, None])[0])


def distance(shape, point):
    return float(shape.distance(point[:, None])[0])


@given(rays(shapes))
def test_a_hit_lies_on_the_surface(ray):
    shape, origin, direction = ray
    along = first_hit(shape, origin, direction)
    assume(along < 50.0)
    assert distance(shape, origin + along * direction) < 1e-8


@given(rays(shapes))
def test_nothing_lies_before_a_hit(ray):
    """Steps as long as the distance to the surface never cross it (sphere tracing)."""
    shape, origin, direction = ray
    assume(distance(shape, origin) > 1e-6)
    along = first_hit(shape, origin, direction)
    walked = 0.0
    for _ in range(200):
        step = distance(shape, origin + walked * direction)
        walked += step
        if step < 1e-12 or walked > 50.0:
            break
    assert walked <= along + 1e-6  # a surface before the hit would not let it be reached
    if step < 1e-12:
        assert along == pytest.approx(walked, abs=1e-4)


@given(rays(spheres))
def test_a_sphere_is_met_where_its_equation_holds(ray):
    """|o + t d - c|^2 = r^2, solved as a polynomial."""
    sphere, origin, direction = ray
    offset = origin - sphere.center
    roots = np.roots([1.0, 2.0 * offset @ direction, offset @ offset - sphere.radius**2])
    ahead = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    discriminant = (offset @ direction) ** 2 - offset @ offset + sphere.radius**2
    assume(abs(discriminant) > 1e-6 and all(abs(root) > 1e-6 for root in roots))
    assert first_hit(sphere, origin, direction) == pytest.approx(min(ahead, default=math.inf))


@given(rays(boxes))
def test_a_box_is_met_on_the_nearest_of_its_six_faces(ray):
    box, origin, direction = ray
    hits = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal = box.pose.rotation[:, axis]
            face = Plane(box.center + side * box.size[axis] / 2.0 * normal, normal)
            along = first_hit(face, origin, direction)
            if math.isfinite(along):
                local = (origin + along * direction - box.center) @ box.pose.rotation
                margins = np.delete(box.size / 2.0 - np.abs(local), axis)
                assume((np.abs(margins) > 1e-9).all())
                hits += [along] if (margins > 0.0).all() else []
    assert first_hit(box, origin, direction) == pytest.approx(min(hits, default=math.inf))


@pytest.mark.parametrize(
    ('origin', 'direction', 'expected'),
    [
        ([5.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 4.5),  # the side
        ([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], 4.0),  # an end, along the axis
        ([0.3, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0),  # an end, from within, beside the axis
        ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.5),  # the side, from within
        ([0.6, 0.0, 5.0], [0.0, 0.0, -1.0], math.inf),  # beside it, along the axis
        ([0.0, 0.0, 5.0], [0.0, 0.0, 1.0], math.inf),  # behind the ray
        ([5.0, 0.0, 1.1], [-1.0, 0.0, 0.0], math.inf),  # over it
        ([1.5, 0.0, 2.0], [-math.sqrt(0.5), 0.0, -math.sqrt(0.5)], math.sqrt(2.0)),  # the rim
    ],
)
def test_a_cylinder_is_met(origin, direction, expected):
    cylinder = Cylinder(Pose(np.zeros(3), np.eye(3)), radius=0.5, length=2.0)
    hit = first_hit(cylinder, np.array(origin), np.array(direction))
    assert hit == pytest.approx(expected)


def test_a_plane_is_met_from_both_sides():
    plane = Plane(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 3.0]))
    up = np.array([0.6, 0.0, 0.8])
    assert first_hit(plane, np.zeros(3), up) == pytest.approx(2.5)
    assert first_hit(plane, np.array([0.0, 0.0, 4.0]), -up) == pytest.approx(2.5)
    assert first_hit(plane, np.zeros(3), -up) == math.inf
    assert first_hit(plane, np.zeros(3), np.array([1.0, 0.0, 0.0])) == math.inf


def grid(*axes):
    """Return all combinations of the axes' values as columns."""
    return np.array([values.ravel() for values in np.meshgrid(*axes)])


TURN = np.linspace(0.0, math.tau, 121)
SPAN = np.linspace(-1.0, 1.0, 41)


def samples_of(shape):
    """Return a grid of points on a surface, no further apart than a tenth of its radius."""
    if isinstance(shape, Sphere):
        angle, z = grid(TURN, np.sin(SPAN * math.pi / 2.0))
        ring = np.sqrt(1.0 - z**2)
        unit_sphere = np.stack([ring * np.cos(angle), ring * np.sin(angle), z])
        return shape.center[:, None] + shape.radius * unit_sphere
    if isinstance(shape, Box):
        faces = [np.roll(grid([-1.0, 1.0], SPAN, SPAN), axis, axis=0) for axis in range(3)]
        local = np.concatenate(faces, axis=1) * shape.size[:, None] / 2.0
    else:
        side, ends = grid(TURN, [1.0], SPAN), grid(TURN, np.abs(SPAN), [-1.0, 1.0])
        angle, ring, z = np.concatenate([side, ends], axis=1)
        ring, z = ring * shape.radius, z * shape.length / 2.0
        local = np.stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return shape.pose.to_parent(local.T).T


@given(st.one_of(spheres, boxes, cylinders), points)
def test_the_distance_is_that_of_the_nearest_sampled_point(shape, point):
    nearest = np.linalg.norm(samples_of(shape) - point[:, None], axis=0).min()
    exact = distance(shape, point)
    assert exact <= nearest + 1e-9
    assert nearest <= exact + 0.05 * shape.bounding_radius


@given(boxes, st.tuples(*[st.floats(-0.99, 0.99)] * 3).map(np.array))
def test_within_a_box_the_distance_is_that_to_the_nearest_face(box, share):
    inside = share * box.size / 2.0
    expected = (box.size / 2.0 - np.abs(inside)).min()
    point = box.pose.rotation @ inside + box.center
    assert distance(box, point) == pytest.approx(expected, abs=1e-12)


@given(st.one_of(spheres, boxes, cylinders), directions)
def test_the_bounding_sphere_holds_the_solid(shape, direction):
    reach = first_hit(shape, np.array(shape.center), direction)
    assert reach <= shape.bounding_radius + 1e-9


@pytest.mark.parametrize(
    ('make', 'key'),
    [
        (lambda: Sphere(np.zeros(3), 0.0), 'radius'),
        (lambda: Box(Pose.from_xyzrpy([0.0] * 6), np.array([1.0, -1.0, 1.0])), 'size'),
        (lambda: Cylinder(Pose.from_xyzrpy([0.0] * 6), -0.1, 1.0), 'radius'),
        (lambda: Cylinder(Pose.from_xyzrpy([0.0] * 6), 0.1, 0.0), 'length'),
        (lambda: Plane(np.zeros(3), np.zeros(3)), 'normal'),
    ],
)
def test_a_shape_without_extent_is_refused(make, key):
    with pytest.raises(ParameterError) as error:
        make()
    assert error.value.key == key


@given(poses, points)
def test_a_pose_in_a_pose_is_their_product(pose, point):
    inner = Pose.from_xyzrpy([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
    one_by_one = pose.to_parent(inner.to_parent(point[None]))
    np.testing.assert_allclose((pose @ inner).to_parent(point[None]), one_by_one, atol=1e-12)


@given(poses, points)
def test_a_pose_leads_there_and_back(pose, point):
    back = pose.to_child(pose.to_parent(point[None]))
    np.testing.assert_allclose(back, point[None], atol=1e-12)


@given(poses)
def test_a_quaternion_of_ros_leads_to_the_same_pose(pose):
    back = Pose.from_quaternion(pose.position, pose.quaternion)
    np.testing.assert_allclose(back.rotation, pose.rotation, atol=1e-12)
    np.testing.assert_array_equal(back.position, pose.position)


def test_a_quaternion_of_ros_has_its_scalar_last():
    upwards = Pose.from_quaternion((0.0, 0.0, 0.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    turned = upwards.to_parent(np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(turned, [[0.0, 1.0, 0.0]], atol=1e-12)


def test_roll_pitch_and_yaw_turn_about_fixed_axes_in_that_order():
    pose = Pose.from_xyzrpy([1.0, 2.0, 3.0, math.pi / 2, 0.0, math.pi / 2])
    # y is rolled onto z, which the yaw leaves; x is yawed onto y.
    turned = pose.to_parent(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(turned, [[1.0, 2.0, 4.0], [1.0, 3.0, 3.0]], atol=1e-12)
