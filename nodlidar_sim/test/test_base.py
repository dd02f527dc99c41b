import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_sim.base import ConstantTwist, odometry_of, to_parent
import numpy as np
import pytest

S = 1_000_000_000


def test_a_base_that_stands_has_one_pose():
    poses = ConstantTwist((1.0, 2.0, 0.5)).poses(np.array([0, S, 2 * S]))
    np.testing.assert_array_equal(poses, [[1.0, 2.0, 0.5]])


def test_a_base_drives_straight_along_its_heading():
    base = ConstantTwist((1.0, 2.0, math.pi / 2), (0.5, 0.0), start_ns=S)
    expected = [[1.0, 2.0, math.pi / 2], [1.0, 3.0, math.pi / 2]]
    np.testing.assert_allclose(base.poses(np.array([S, 3 * S])), expected, atol=1e-12)


def test_a_quarter_turn_ends_beside_the_centre_of_the_circle():
    """1 m/s at pi/2 rad/s is a circle of radius 2/pi; after 1 s a quarter is done."""
    base = ConstantTwist((0.0, 0.0, 0.0), (1.0, math.pi / 2))
    radius = 2.0 / math.pi
    np.testing.assert_allclose(base.poses(np.array([S])), [[radius, radius, math.pi / 2]])


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_an_arc_is_the_integral_of_the_twist(speed, rate, yaw):
    base = ConstantTwist((0.3, -0.2, yaw), (speed, rate))
    times = np.arange(0, 2 * S + 1, S // 1000)
    heading = yaw + rate * (times[:-1] + S // 2000) / S
    x = 0.3 + np.cumsum(speed * np.cos(heading)) / 1000.0
    y = -0.2 + np.cumsum(speed * np.sin(heading)) / 1000.0
    expected = np.stack([x, y, yaw + rate * times[1:] / S], axis=1)
    poses = np.broadcast_to(base.poses(times), (len(times), 3))
    np.testing.assert_allclose(poses[1:], expected, atol=1e-5)


def test_points_of_the_base_are_turned_and_moved():
    points = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]])
    poses = np.array([[10.0, 20.0, math.pi / 2], [10.0, 20.0, math.pi]])
    expected = [[10.0, 21.0, 0.5], [10.0, 19.0, 0.0]]
    np.testing.assert_allclose(to_parent(points, poses), expected)


def test_odometry_without_error_is_the_motion_seen_from_its_start():
    base = ConstantTwist((5.0, -3.0, 1.0), (0.4, 0.3), start_ns=7 * S)
    times = np.array([7 * S, 9 * S])
    odometry = odometry_of(base, 0.0).poses(times)
    np.testing.assert_array_equal(odometry[0], 0.0)
    in_world = to_parent(
        np.append(odometry[:, :2], np.zeros((2, 1)), axis=1), np.array([base.start])
    )
    np.testing.assert_allclose(in_world[:, :2], base.poses(times)[:, :2])


def test_odometry_errs_by_its_share_of_the_way():
    """The mean of two wheels that err by 2 % each errs by 2 % / sqrt(2)."""
    base = ConstantTwist((0.0, 0.0, 0.0), (1.0, 0.0))
    speeds, rates = np.array([odometry_of(base, 0.02, seed).velocity for seed in range(3000)]).T
    assert speeds.mean() == pytest.approx(1.0, abs=1e-3)
    assert speeds.std() == pytest.approx(0.02 / math.sqrt(2.0), rel=0.05)
    assert rates.std() == pytest.approx(0.02 * math.sqrt(2.0) / 0.4, rel=0.05)


def test_odometry_of_a_base_that_stands_does_not_drift():
    assert odometry_of(ConstantTwist(), 0.5, seed=1).velocity == (0.0, 0.0)
