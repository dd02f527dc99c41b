import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_sim.world.planar import (
    compose,
    displacement,
    motion_of,
    relative,
    to_child,
    to_parent,
)
import numpy as np

metres = st.floats(-20.0, 20.0)
poses = st.tuples(metres, metres, st.floats(-3.0, 3.0)).map(lambda pose: np.array([pose]))


def test_points_of_the_base_are_turned_and_moved():
    points = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]])
    there = np.array([[10.0, 20.0, math.pi / 2], [10.0, 20.0, math.pi]])
    expected = [[10.0, 21.0, 0.5], [10.0, 19.0, 0.0]]
    np.testing.assert_allclose(to_parent(points, there), expected)
    np.testing.assert_allclose(to_child(to_parent(points, there), there), points, atol=1e-12)
    one = there[:1]
    np.testing.assert_allclose(to_child(to_parent(points, one), one), points, atol=1e-12)


@given(poses, poses)
def test_a_relative_pose_leads_back(one, other):
    np.testing.assert_allclose(compose(one, relative(one, other)), other, atol=1e-12)


@given(st.tuples(metres, metres, st.floats(-3.1, 3.1)))
def test_a_motion_is_found_from_where_it_leads(motion):
    motion = np.array([motion])
    np.testing.assert_allclose(motion_of(displacement(motion)), motion, atol=1e-9)


@given(st.tuples(metres, metres, st.floats(-7.0, 7.0)))
def test_a_displacement_is_many_small_steps(motion):
    steps = 20000
    small = np.array([motion]) / steps
    heading = (np.arange(steps) + 0.5) * small[0, 2]
    x = np.sum(small[0, 0] * np.cos(heading) - small[0, 1] * np.sin(heading))
    y = np.sum(small[0, 0] * np.sin(heading) + small[0, 1] * np.cos(heading))
    np.testing.assert_allclose(displacement(np.array([motion])), [[x, y, motion[2]]], atol=1e-5)
