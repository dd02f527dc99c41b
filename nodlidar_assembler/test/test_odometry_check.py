"""Odometry that leaps or scatters, as no robot moves, or whose stamps jitter."""

import math
import re

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.plausibility.odometry_check import OdometryCheck
from nodlidar_assembler.plausibility.odometry_jitter import OdometryJitter
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000


def warning_of(pose, rate=50.0, duration=12.0):
    """Return the warning about odometry, x [m], y [m] and yaw [rad] at times [s]."""
    times = np.arange(round(duration * rate)) / rate
    return warning_about([pose(t, k) for k, t in enumerate(times.tolist())], times)


def warning_about(poses, stamps):
    """Return the warning about poses with stamps [s]."""
    check = OdometryCheck()
    for (x, y, yaw), stamp in zip(poses, stamps, strict=True):
        turn = (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
        check.add(START_NS + round(stamp * 1e9), (x, y, 0.0), turn)
    return check.warning


def driven(t, speed=0.4, turn=0.5):
    """Return the pose on a circle."""
    return speed / turn * math.sin(turn * t), speed / turn * (1.0 - math.cos(turn * t)), turn * t


@pytest.mark.parametrize('rate', [10.0, 20.0, 50.0, 200.0])
def test_odometry_that_flaps_with_each_sample_scatters(rate):
    def flapping(t, k):
        x, y, yaw = driven(t)
        return x + 0.05 * (k % 2), y, yaw

    found = warning_of(flapping, rate)
    assert re.search(r'points 2 m away are 50 mm off', found)


@pytest.mark.parametrize('rate', [20.0, 50.0, 200.0])
@pytest.mark.parametrize('period', [2.5, 1.3])
def test_odometry_that_leaps_now_and_then_is_named_with_how_far(rate, period):
    def flapping(t, k):
        x, y, yaw = driven(t)
        return x, y + 0.05 * (math.floor(t / period) % 2), yaw

    found = warning_of(flapping, rate)
    times, size = map(int, re.search(r'leaps: (\d+) times .* by (\d+) mm', found).groups())
    assert abs(times - 10.0 / period) <= 1.0
    assert size == pytest.approx(50, abs=5)


def test_a_heading_that_leaps_counts_at_the_distance_of_the_points():
    def flapping(t, k):
        return 0.4 * t, 0.0, 0.05 * (math.floor(t / 1.7) % 2)

    size = int(re.search(r'by (\d+) mm', warning_of(flapping))[1])
    assert size == pytest.approx(50 * 2.0 * math.sqrt(2.0 / 3.0), abs=2)


@given(
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.sampled_from([10.0, 20.0, 50.0, 100.0]),
    st.integers(0, 1000),
)
def test_a_robot_that_speeds_up_and_brakes_is_not_named(speed, turn, rate, seed):
    """At 3 m/s^2 and 10 rad/s^2, to other speeds every half a second."""
    rng, fine = np.random.default_rng(seed), 200
    wanted = rng.uniform(-1.0, 1.0, (24, 2)).repeat(fine // 2, axis=0) * (speed, turn)
    velocity, most = np.zeros((len(wanted) + 1, 2)), np.array([3.0, 10.0]) / fine
    for k, want in enumerate(wanted):
        velocity[k + 1] = velocity[k] + np.clip(want - velocity[k], -most, most)
    yaw = velocity[:, 1].cumsum() / fine
    x = (velocity[:, 0] * np.cos(yaw)).cumsum() / fine
    y = (velocity[:, 0] * np.sin(yaw)).cumsum() / fine
    assert warning_of(lambda t, k: [each[round(t * fine)] for each in (x, y, yaw)], rate) == ''


@pytest.mark.parametrize('noise', [0.002, 0.004])
def test_noise_of_a_few_millimetres_is_not_named(noise):
    rng = np.random.default_rng(3)

    def noisy(t, k):
        return np.add(driven(t), rng.normal(0.0, noise, 3) * (1.0, 1.0, 0.5))

    assert warning_of(noisy) == ''


def test_noise_of_centimetres_is_named_with_its_size():
    rng = np.random.default_rng(3)
    found = warning_of(lambda t, k: (0.4 * t, rng.normal(0.0, 0.02), 0.0))
    assert int(re.search(r'are (\d+) mm off RMS', found)[1]) == pytest.approx(20, rel=0.2)


def test_a_correction_or_two_are_not_named():
    def corrected(t, k):
        return 0.4 * t + 0.1 * (t > 4.0) - 0.2 * (t > 9.0), 0.0, 0.0

    assert warning_of(corrected) == ''


def test_odometry_that_recovers_is_no_longer_named():
    def flapping(t, k):
        return 0.05 * (k % 2) * (t < 5.0), 0.0, 0.0

    assert warning_of(flapping, duration=5.0)
    assert warning_of(flapping, duration=17.0) == ''


@pytest.mark.parametrize('rate', [20.0, 50.0, 200.0])
def test_stamps_that_jitter_are_named_with_their_size_and_the_period(rate):
    times, rng = np.arange(12.0 * rate) / rate, np.random.default_rng(3)
    stamps = np.sort(times + rng.exponential(0.02, len(times)))
    found = warning_about([driven(t, 0.6, 0.8) for t in times], stamps)
    jitter = float(re.search(r'stamps of odometry jitter by (\d+) ms', found)[1])
    assert jitter == pytest.approx(1e3 * np.std(stamps - times), rel=0.2)
    assert float(re.search(r'odometry_period to ([\d.]+)', found)[1]) * rate == pytest.approx(
        1.0, abs=0.02
    )


def test_uneven_samples_with_the_stamps_of_their_measurement_are_not_named():
    times = np.sort(np.random.default_rng(3).uniform(0.0, 12.0, 600))
    assert warning_about([driven(t, 0.6, 0.8) for t in times], times) == ''


def test_a_clock_that_was_set_while_recording_takes_no_time():
    """Only the part after it jitters; from 1970, there are 1.7e8 windows without a sample."""
    rng = np.random.default_rng(1)
    even = np.arange(0.0, 30.0, 0.05)
    stamps = np.concatenate([even, 1.7e9 + even + rng.uniform(0.0, 0.04, len(even))])
    time_ns = np.rint(stamps * 1e9).astype(np.int64)
    poses = [driven(t) for t in (*even, *even)]
    position = np.array([(x, y, 0.0) for x, y, _ in poses])
    half = np.array([yaw / 2.0 for *_, yaw in poses])
    turn = np.stack([0.0 * half, 0.0 * half, np.sin(half), np.cos(half)], axis=1)
    found = OdometryJitter.worst(Odometry(time_ns, Poses(position, turn)))
    assert found.seconds == pytest.approx(0.04 / 12.0**0.5, rel=0.2)


def test_a_single_sample_does_not_jitter():
    poses = Poses(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]))
    assert OdometryJitter.worst(Odometry(np.array([START_NS]), poses)) is None


def test_lost_samples_are_not_named():
    kept = np.random.default_rng(3).random(600) > 0.1
    times = np.flatnonzero(kept) / 50.0
    assert warning_about([driven(t, 0.6, 0.8) for t in times], times) == ''
