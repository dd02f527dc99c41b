import math

from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.odometry import Odometer
from nodlidar_sim.world.planar import compose
from nodlidar_sim.world.route import Leg, Plan
import numpy as np
import pytest

S = 1_000_000_000
SECONDS = np.arange(501) * (S // 50)
START = (5.0, -3.0, 1.0)
WINDING = Plan((0.4, 0.3), (Leg(2.01, (0.5, -0.6)), Leg(1.0, (0.0, 1.0)), Leg(3.0, (0.3, 0.0))))


def odometry(plan, seed=0, start=START, **effects):
    return Odometer(plan.route(start, 0), Effects(**effects), 0, seed).poses(SECONDS)


def test_without_errors_it_is_the_motion_seen_from_its_start():
    found = odometry(WINDING)
    np.testing.assert_array_equal(found[0], 0.0)
    expected = WINDING.route(START, 0).poses(SECONDS)
    np.testing.assert_allclose(compose(np.array([START]), found), expected, atol=1e-12)


def test_errors_too_small_to_see_change_nothing_that_is_seen():
    """The wheels' ways, added up, are the true motion, through every change of the velocity."""
    tiny = odometry(WINDING, odometry_error=1e-12)
    np.testing.assert_allclose(tiny, odometry(WINDING), atol=1e-9)


def ends(plan, runs=1500, **effects):
    times = np.arange(51) * (S // 50)
    route = plan.route((0.0, 0.0, 0.0), 0)
    return np.array(
        [Odometer(route, Effects(**effects), 0, seed).poses(times)[-1] for seed in range(runs)]
    )


def test_wheels_of_unknown_size_err_by_their_share_of_the_way():
    """The mean of two wheels that err by 2 % each errs by 2 % / sqrt(2)."""
    x, _, yaw = ends(Plan((1.0, 0.0)), odometry_error=0.02).T
    assert x.mean() == pytest.approx(1.0, abs=2e-3)
    assert x.std() == pytest.approx(0.02 / math.sqrt(2.0), rel=0.07)
    assert yaw.std() == pytest.approx(0.02 * math.sqrt(2.0) / 0.4, rel=0.07)


def test_a_slipping_wheel_counts_too_much():
    """The mean of |N(0, s)| is s sqrt(2 / pi); of 50 samples of two wheels it varies little."""
    x, _, yaw = ends(Plan((1.0, 0.0)), runs=400, wheel_slip=0.1).T
    assert x.mean() == pytest.approx(1.0 + 0.1 * math.sqrt(2.0 / math.pi), rel=2e-3)
    share = 0.1 * math.sqrt(1.0 - 2.0 / math.pi)  # deviation of |N(0, s)|
    assert yaw.std() == pytest.approx(share * math.sqrt(2.0 / 50.0) / 0.4, rel=0.15)
    assert abs(yaw.mean()) < 4.0 * yaw.std() / math.sqrt(400)


def test_the_heading_drifts_at_a_constant_rate():
    _, _, yaw = ends(Plan(), heading_drift=0.01).T
    assert yaw.std() == pytest.approx(0.01, rel=0.07)
    found = odometry(Plan(), heading_drift=0.01)
    np.testing.assert_allclose(found[:, 2], found[-1, 2] * np.arange(501) / 500.0, atol=1e-12)
    np.testing.assert_array_equal(found[:, :2], 0.0)


def test_a_base_that_stands_has_no_wheels_that_err():
    found = odometry(Plan(), odometry_error=0.5, wheel_slip=0.5)
    np.testing.assert_array_equal(found, np.zeros((501, 3)))


def test_samples_come_out_the_same_one_by_one():
    effects = Effects(odometry_error=0.02, wheel_slip=0.1, heading_drift=0.01)
    one_by_one = Odometer(WINDING.route(START, 0), effects, 0, seed=3)
    found = np.concatenate([one_by_one.poses(SECONDS[[k]]) for k in range(501)])
    at_once = odometry(WINDING, 3, odometry_error=0.02, wheel_slip=0.1, heading_drift=0.01)
    np.testing.assert_allclose(found, at_once, atol=1e-12)
