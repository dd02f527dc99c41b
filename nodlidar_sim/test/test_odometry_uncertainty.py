"""The computed uncertainty of odometry, against the errors of many odometers."""

from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.odometry import Odometer, WHEEL_DISTANCE
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.planar import motion_of, relative
from nodlidar_sim.world.route import Leg, Plan
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
PERIOD = 0.02
TIMES_NS = START_NS + np.arange(1, 301) * round(PERIOD * 1e9)
ROUTE = Plan((0.3, -0.6), (Leg(2.0, (0.5, 0.0)), Leg(2.0, (0.4, 0.8)))).route(
    (1.0, -2.0, 0.9), START_NS
)
ERRORS = [
    Effects(odometry_error=0.02),
    Effects(heading_drift=0.02),
    Effects(wheel_slip=0.05),
    Effects(odometry_error=0.01, wheel_slip=0.05, heading_drift=0.01),
]


def true_poses():
    return Odometer(ROUTE, Effects(), START_NS).poses(TIMES_NS)


def uncertainty_of(effects):
    """Return the uncertainty after the whole route."""
    poses = np.concatenate([np.zeros((1, 3)), true_poses()])
    uncertainty = OdometryUncertainty(effects)
    for before, motion in zip(poses, motion_of(relative(poses[:-1], poses[1:])), strict=False):
        uncertainty.add(before[2], motion, PERIOD)
    return uncertainty


@pytest.mark.parametrize('effects', ERRORS)
def test_it_is_the_mean_square_of_the_errors_of_many_odometers(effects):
    ends = [Odometer(ROUTE, effects, START_NS, seed).poses(TIMES_NS)[-1] for seed in range(600)]
    errors = np.array(ends) - true_poses()[-1]
    expected = errors.T @ errors / len(errors)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(uncertainty_of(effects).of_pose / scale, expected / scale, atol=0.2)


@pytest.mark.parametrize('effects', ERRORS)
def test_a_velocity_is_as_uncertain_as_those_of_many_odometers(effects):
    route = Plan((0.4, 0.8)).route((0.0, 0.0, 0.0), START_NS)
    steps = [Odometer(route, effects, START_NS, seed).poses(TIMES_NS[:1]) for seed in range(1500)]
    errors = motion_of(np.concatenate(steps)) / PERIOD - np.array([0.4, 0.0, 0.8])
    expected = errors.T @ errors / len(errors)
    found = OdometryUncertainty(effects).of_velocity(np.array([0.4, 0.0, 0.8]))
    np.testing.assert_allclose(found, expected, atol=0.1 * np.max(expected))


def test_wheels_that_miscount_by_a_share_make_a_straight_way_wrong_by_it():
    """Along by share / sqrt 2, in heading by sqrt 2 share / wheel distance each metre."""
    uncertainty = OdometryUncertainty(Effects(odometry_error=0.02))
    for _ in range(100):
        uncertainty.add(0.0, np.array([0.03, 0.0, 0.0]), PERIOD)
    along, heading = 3.0 * 0.02 / np.sqrt(2), 3.0 * 0.02 * np.sqrt(2) / WHEEL_DISTANCE
    variances = np.diag(uncertainty.of_pose)
    assert np.sqrt(variances[[0, 2]]) == pytest.approx([along, heading])
    assert np.sqrt(variances[1]) == pytest.approx(heading * 3.0 / 2.0, rel=0.01)


def test_exact_odometry_is_certain():
    uncertainty = uncertainty_of(Effects())
    assert not uncertainty.of_pose.any()
    assert not uncertainty.of_velocity(np.array([0.4, 0.0, 0.8])).any()


def test_a_base_that_stands_is_uncertain_only_by_the_drift_of_its_heading():
    uncertainty = OdometryUncertainty(Effects(0, 0, 0, 0, 0.02, 0.3, 0.01))
    for _ in range(50):
        uncertainty.add(0.7, np.zeros(3), PERIOD)
    np.testing.assert_allclose(uncertainty.of_pose, np.diag([0.0, 0.0, 0.01**2]))
