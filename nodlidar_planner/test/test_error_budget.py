"""The error budget against brute force: simulated samples, integrals and displaced points."""

from dataclasses import fields, replace
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.error_budget.budget import Beams, beams_at, budget_of, ErrorBudget, SOURCES
from nodlidar_planner.error_budget.parameters import ErrorParameters, SERVO_ERRORS
from nodlidar_planner.error_budget.pitch_error import (
    between_samples,
    of_samples,
    on_legs,
    pitch_variance,
    smoothed,
)
from nodlidar_planner.error_budget.swing import Swing
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS
from nodlidar_planner.pattern.task import Task
from nodlidar_sim.devices.servo_models import EMULATED
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.encoder import Encoder
import numpy as np
import pytest
from scipy.integrate import quad

SWING = Swing(3.14, 0.39, 200.0)
NOTHING = ErrorParameters(
    estimator='slerp',
    **{f.name: 0.0 for f in fields(ErrorParameters) if f.default != 'slerp'}
    | {'joint_rate': 1e4, 'encoder_step': 1e-7, 'reversal_acceleration': 200.0},
)
BEAMS = Beams(
    np.array([0.5, 1.0, 2.0, 4.0, 3.0]),
    np.array([0.0, 0.7, -1.4, 2.0, -0.3]),
    np.array([0.0, -0.6, 0.3, 0.6, -0.2]),
)
LEVER = 0.08


def places(ranges, azimuth, pitch, shift=0.0, turn=0.0):
    """Return the points (n, 3), with errors of the lidar's place (3,) and rotation vector (3,)."""
    local = np.stack([ranges * np.cos(azimuth), ranges * np.sin(azimuth), 0.0 * ranges], axis=-1)
    x, y, z = (local + np.cross(turn * np.ones(3), local) + [0.0, 0.0, LEVER] + shift).T
    c, s = np.cos(pitch), np.sin(pitch)
    return np.stack([x * c - z * s, y, x * s + z * c], axis=-1)


def true_places():
    return places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch)


def squares(name, **errors):
    """Return the mean squares of one source, the only one with errors but for the encoder's."""
    found = ErrorBudget(replace(NOTHING, laser_above=LEVER, **errors), SWING).squares(BEAMS)
    rest = sum(np.abs(found[other]).max() for other in SOURCES if other != name)
    assert rest < 1e-5 * found[name].max()
    return found[name]


def test_the_swing_joins_legs_by_parabolas():
    times = np.linspace(0.0, 0.78, 780_001)
    pitch = SWING.pitch(times)
    speed = np.gradient(pitch, times)
    assert np.mean(speed**2) == pytest.approx(SWING.mean_square_speed, rel=1e-4)
    assert np.abs(speed).max() == pytest.approx(3.14, rel=1e-6)
    bends = np.abs(np.gradient(speed, times))
    assert np.mean(bends > 100.0) == pytest.approx(SWING.reversal_time / 0.39, rel=1e-2)
    assert np.interp([0.1, 0.195, 0.585], times, pitch) == pytest.approx([-0.2983, 0.0, 0.0])


@pytest.mark.parametrize(
    ('step', 'noise', 'speed', 'rate'),
    [
        (0.005, 0.0, 3.14, 100.0),
        (0.005, 0.0, 0.05, 100.0),  # neighbours have almost the same error
        (0.005, 0.0015, 0.3, 100.0),
        (0.001, 0.0003, 0.07, 150.0),
        (0.005, 0.01, 1.0, 50.0),
    ],
)
def test_errors_of_the_samples_are_those_of_simulated_ones(step, noise, speed, rate):
    rng = np.random.default_rng(1)
    exact = rng.uniform(-1.0, 1.0, 200_000)[:, None] + [0.0, speed / rate]
    errors = np.rint((exact + rng.normal(0.0, noise, exact.shape)) / step) * step - exact
    share = rng.random(len(errors))
    simulated = np.mean(((1.0 - share) * errors[:, 0] + share * errors[:, 1]) ** 2)
    parameters = replace(NOTHING, encoder_step=step, encoder_noise=noise, joint_rate=rate)
    assert of_samples(parameters, replace(SWING, speed=speed)) == pytest.approx(
        simulated, rel=0.02
    )


def test_a_sharp_reversal_loses_a_ninetieth():
    """A bend of 2 w in an interval T costs 4 w^2 T^3 / 90 a sweep, on average over its place."""
    swing = Swing(2.0, 0.5, 1e5)
    expected = 4.0 * 2.0**2 * 0.02**3 / 90.0 / 0.5
    assert between_samples(replace(NOTHING, joint_rate=50.0), swing) == pytest.approx(
        expected, rel=0.02
    )


def test_a_long_reversal_costs_the_sagitta_of_its_parabola():
    """A chord errs by a u (1 - u) T^2 / 2, squared a^2 T^4 / 120."""
    swing = Swing(2.0, 0.5, 10.0)
    expected = 10.0**2 * 0.005**4 / 120.0 * swing.reversal_time / 0.5
    assert between_samples(replace(NOTHING, joint_rate=200.0), swing) == pytest.approx(
        expected, rel=0.03
    )


@pytest.mark.parametrize(('order', 'intensity'), [(2, 36.0), (3, 1e4), (3, 2e6)])
def test_smoothing_leaves_what_a_wiener_smoother_leaves(order, intensity):
    noise = 2e-3**2 / 80.0
    density = lambda w: intensity * noise / (intensity + noise * w ** (2 * order)) / math.pi  # noqa: E731
    expected = quad(density, 0.0, 1e4, limit=500)[0]
    assert smoothed(noise, intensity, order) == pytest.approx(expected, rel=1e-3)


def test_smoothing_a_random_motion_leaves_as_much():
    """The best linear estimate, by the covariances of a motion of white jerk and its samples."""
    jerk, deviation, period = 1e4, 2e-3, 0.01
    grid = np.arange(-0.3, 0.3, 1e-3)
    samples = np.arange(-0.2, 0.2, period)[:, None]
    beams = np.arange(-period / 2.0, period / 2.0, 1e-3)[:, None]
    # Position by white jerk before it, and any start: an almost unknown parabola.
    spread = math.sqrt(jerk * 1e-3)

    def response(t):
        by_jerk = spread * np.maximum(t - grid, 0.0) ** 2 / 2.0
        return np.hstack([by_jerk, 1e2 * np.ones_like(t), 1e3 * t, 1e4 * t**2])

    by_samples, by_beams = response(samples), response(beams)
    covariance = by_samples @ by_samples.T + deviation**2 * np.eye(len(samples))
    gain = np.linalg.solve(covariance, by_samples @ by_beams.T).T
    left = np.sum((by_beams - gain @ by_samples) ** 2, axis=1)
    left += deviation**2 * np.sum(gain**2, axis=1)
    assert smoothed(deviation**2 * period, jerk, 3) == pytest.approx(left.mean(), rel=0.05)


def test_a_reversal_adds_to_what_the_legs_have():
    parameters = replace(ErrorParameters(), estimator='trajectory')
    slow, fast = (pitch_variance(parameters, Swing(w, 1.2 / w, 200.0)) for w in (0.1, 5.0))
    assert slow == pytest.approx(on_legs(parameters, Swing(0.1, 12.0, 200.0)), rel=0.05)
    assert fast > 1.1 * slow


def test_trajectory_is_never_worse_than_slerp():
    for rate in (10.0, 60.0, 1000.0):
        slerp = replace(ErrorParameters(), joint_rate=rate)
        smooth = replace(slerp, estimator='trajectory')
        assert pitch_variance(smooth, SWING) <= pitch_variance(slerp, SWING)


def test_an_error_of_the_range_moves_the_point_along_its_beam():
    found = squares('range noise', range_noise=0.006, range_noise_growth=0.004)
    assert found == pytest.approx(0.006**2 + (0.004 * BEAMS.ranges) ** 2)
    assert squares('range bias', range_bias=0.01) == pytest.approx(1e-4)


def test_an_error_of_the_pitch_turns_the_point_about_the_axis():
    moved = places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch + 1e-5) - true_places()
    per_rad2 = np.sum(moved**2, axis=1) / 1e-10
    assert squares('backlash', backlash=0.004) == pytest.approx(per_rad2 * 0.002**2, rel=1e-4)
    found = squares('backlash', backlash=0.004, deflection=0.001)
    assert found == pytest.approx(per_rad2 * 0.003**2, rel=1e-4)
    found = squares('encoder error', encoder_error=0.003)
    assert found == pytest.approx(per_rad2 * 9e-6, rel=1e-4)
    found = squares('pitch estimate', encoder_noise=0.002)
    assert found == pytest.approx(per_rad2 * 2.0 / 3.0 * 0.002**2, rel=1e-2)


def test_a_delay_turns_it_by_the_motion_in_that_time():
    times = np.linspace(0.0, 0.78, 20_000)
    late = SWING.pitch(times + 1e-5) - SWING.pitch(times)
    points = places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch)
    turned = places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch + np.sqrt(np.mean(late**2)))
    expected = np.sum((turned - points) ** 2, axis=1) * (0.001 / 1e-5) ** 2
    assert squares('joint delay', joint_delay_error=0.001) == pytest.approx(expected, rel=1e-3)
    assert squares('scan delay', scan_delay_error=0.001) == pytest.approx(expected, rel=1e-3)


def test_errors_of_the_mount_are_those_of_displaced_lidars():
    expected = np.zeros(len(BEAMS.ranges))
    for axis in np.eye(3):
        for error in ({'shift': 0.003 * axis}, {'turn': 0.002 * axis}):
            moved = places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch, **error) - true_places()
            expected += np.sum(moved**2, axis=1)
    found = squares('mount', mount_position_error=0.003, mount_angle_error=0.002)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize('centre', [0.0, math.pi])
@pytest.mark.parametrize('half', [0.5, 2.0, math.pi])
def test_errors_of_odometry_are_those_of_a_robot_that_goes_astray(centre, half):
    """To both sides alike, since the first order neglects what differs between left and right."""
    azimuth = centre + half * (2.0 * np.arange(72) + 1.0 - 72.0) / 72.0
    beams = Beams(np.full(72, 2.0), azimuth, np.full(72, 0.3))
    errors = {'odometry_speed_error': 0.02, 'odometry_turn_error': 0.03}
    parameters = replace(NOTHING, robot_speed=0.5, cloud_time=1.5, **errors)
    found = ErrorBudget(parameters, SWING).squares(beams)['odometry']
    x, y, _ = places(beams.ranges, azimuth, beams.pitch).T
    x = x + LEVER * math.sin(0.3)
    expected = []
    for speed_error, turn_error in ((0.02, 0.0), (0.0, 0.03)):
        for t in (np.arange(100) + 0.5) / 100 * 1.5:
            yaw = turn_error * t
            ahead, aside = (0.5 + speed_error) * t, 0.5 * turn_error * t**2 / 2.0
            moved_x = ahead + x * math.cos(yaw) - y * math.sin(yaw) - (0.5 * t + x)
            moved_y = aside + x * math.sin(yaw) + y * math.cos(yaw) - y
            expected.append(np.mean(moved_x**2 + moved_y**2))
    assert np.mean(found) == pytest.approx(2.0 * np.mean(expected), rel=0.01)


def test_a_late_scan_of_a_driving_robot_is_moved_along():
    parameters = replace(NOTHING, scan_delay_error=0.01, robot_speed=0.5, robot_turn_rate=0.8)
    still = replace(parameters, robot_speed=0.0, robot_turn_rate=0.0)
    driving, standing = (
        ErrorBudget(each, SWING).squares(BEAMS)['scan delay'] for each in (parameters, still)
    )
    x, y, _ = places(BEAMS.ranges, BEAMS.azimuth, BEAMS.pitch).T
    x = x + LEVER * np.sin(BEAMS.pitch)
    assert driving - standing == pytest.approx(1e-4 * (0.25 + 0.64 * (x**2 + y**2)))


def test_the_place_of_the_lidar_counts():
    """Ahead of the nod axis, which is ahead of the point about which the robot turns."""
    errors = {'scan_delay_error': 0.01, 'robot_turn_rate': 0.8, 'odometry_turn_error': 0.03}
    place = {'laser_above': LEVER, 'laser_ahead': 0.12, 'mount_ahead': 0.3}
    parameters = replace(NOTHING, cloud_time=1.0, **place, **errors)
    found = ErrorBudget(parameters, SWING).squares(BEAMS)
    x, y, z = places(BEAMS.ranges, BEAMS.azimuth, 0.0, np.array([0.12, 0.0, 0.0])).T
    from_robot = (0.3 + x * np.cos(BEAMS.pitch)) ** 2 + y**2
    delayed = (x**2 + z**2) * SWING.mean_square_speed + 0.64 * from_robot
    assert found['scan delay'] == pytest.approx(1e-4 * delayed)
    assert found['odometry'] == pytest.approx(9e-4 * from_robot / 3.0)


@pytest.mark.parametrize('servo', SERVO_ERRORS)
def test_the_errors_of_a_servo_are_those_of_its_simulation(servo):
    """The smooth one over the nod and many encoders; each has the error of another."""
    of, simulated = SERVO_ERRORS[servo], load_servo(EMULATED[servo].parameters)
    pitch = np.linspace(Task().pitch_min, Task().pitch_max, 100)
    encoders = [Encoder(simulated, seed).smooth(pitch) for seed in range(500)]
    error = np.sqrt(np.mean((np.array(encoders) - pitch) ** 2))
    assert of['encoder_error'] == pytest.approx(error, rel=0.05)
    assert of['encoder_step'] == pytest.approx(simulated.tick, rel=1e-3)
    assert of['encoder_noise'] == pytest.approx(simulated.encoder_noise * simulated.tick, rel=0.03)
    assert of['backlash'] == simulated.backlash


def test_the_defaults_are_those_of_an_rx24f():
    assert ErrorParameters() == ErrorParameters(**SERVO_ERRORS['RX-24F'])
    assert set(SERVO_ERRORS) == set(MAX_SPEEDS)


def test_on_a_full_circle_beams_all_around_count():
    """The mean of rho^2 is r^2 / 2 + z_off^2; in the window of a URG-04LX it is 0.4 r^2."""
    beams = beams_at(Task(full_circle=True), 3.0)
    assert np.mean(beams.from_axis(LEVER)) == pytest.approx(4.5 + LEVER**2)
    within = np.linspace(Task().window_min, Task().window_max, 10_001)
    mean = np.mean(beams_at(Task(), 3.0).from_axis(0.0))
    assert mean == pytest.approx(9.0 * np.mean(np.cos(within) ** 2), rel=0.02)


@given(st.floats(0.3, 6.0), st.floats(0.2, 8.0), st.sampled_from(['slerp', 'trajectory']))
def test_the_sources_add_up(speed, distance, estimator):
    budget = budget_of(Task(), speed, ErrorParameters(estimator=estimator))
    beams = beams_at(Task(), distance)
    rms = budget.rms(beams)
    total = rms.pop('total')
    assert tuple(rms) == SOURCES
    assert total == pytest.approx(math.sqrt(sum(each**2 for each in rms.values())))
    assert total == pytest.approx(math.sqrt(np.mean(budget.sigma(beams) ** 2)))
    assert total >= rms['range noise'] > 0.006


def test_what_cannot_be_is_refused():
    with pytest.raises(ParameterError, match="'reversal_acceleration' must be at least 60 rad"):
        Swing(3.0, 0.1, 30.0)
    with pytest.raises(ParameterError, match="'speed' must be above 0 rad/s"):
        Swing(0.0, 0.1, 30.0)
    with pytest.raises(ParameterError, match="'estimator' must be one of slerp, trajectory"):
        ErrorParameters(estimator='ends')
    with pytest.raises(ParameterError, match="'joint_rate' must be between 1"):
        ErrorParameters(joint_rate=0.0)
