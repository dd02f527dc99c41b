"""How a servo gets from limit to limit, against motions whose lateness is known."""

from nodlidar_planner.sweeps.lateness import Lateness
import numpy as np
import pytest


def add_scans(lateness, way, durations):
    """Add scans at random times of sweeps of some durations [samples]."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        duration = rng.choice(durations)
        since = np.sort(rng.uniform(0.0, duration, 300))
        lateness.add(since, np.full(300, float(duration)), way(since, duration))


def from_rest(since, duration, ramp=150.0):
    """Return the way of a servo that speeds up for a time, and brakes as long."""
    speed = 1.0 / (duration - ramp)
    up = np.minimum(since, ramp) ** 2 / 2.0 / ramp + np.maximum(since - ramp, 0.0)
    over = np.maximum(since - (duration - ramp), 0.0)
    return speed * (up - over**2 / 2.0 / ramp)


def test_before_anything_is_known_sweeps_are_steady():
    since = np.linspace(0.0, 2500.0, 11)
    assert Lateness(2875.0, 10.0).progress(since, 2500.0) == pytest.approx(since / 2500.0)
    assert Lateness(2875.0, 10.0).spread == pytest.approx(10.0)


def test_a_servo_that_is_always_late_is_foreseen_so():
    lateness = Lateness(2875.0, 10.0)
    add_scans(lateness, lambda since, duration: (since - 30.0) / duration, [2300, 2500, 2700])
    since = np.linspace(100.0, 2400.0, 20)
    assert lateness.progress(since, 2500.0) == pytest.approx((since - 30.0) / 2500.0, abs=1e-4)
    assert lateness.spread < 1.0


def test_acceleration_and_braking_are_predicted_for_unmeasured_durations():
    """The distance from the steady sweep is 75 samples at most."""
    lateness = Lateness(2875.0, 10.0)
    add_scans(lateness, from_rest, [2200, 2300, 2700, 2800])
    since = np.linspace(0.0, 2500.0, 101)
    error = 2500.0 * (lateness.progress(since, 2500.0) - from_rest(since, 2500.0))
    assert np.abs(2500.0 * since / 2500.0 - 2500.0 * from_rest(since, 2500.0)).max() > 60.0
    assert np.abs(error).max() < 16.0
    assert np.sqrt(np.mean(error**2)) < 5.0


def test_the_spread_is_that_of_the_servo():
    lateness, rng = Lateness(2875.0, 0.0), np.random.default_rng(2)
    for _ in range(300):
        late = rng.normal(0.0, 20.0)
        since = np.linspace(1.0, 2499.0, 300)
        lateness.add(since, np.full(300, 2500.0), (since - late) / 2500.0)
    assert lateness.spread == pytest.approx(20.0, rel=0.25)


def test_more_beams_at_once_than_the_memory_replace_it():
    lateness = Lateness(2875.0, 10.0)
    since = np.linspace(0.0, 2500.0, 200_000)
    lateness.add(since, np.full(200_000, 2500.0), (since - 30.0) / 2500.0)
    assert lateness.progress(np.array([500.0]), 2500.0) == pytest.approx(470.0 / 2500.0)
    assert 0.0 <= lateness.spread < 0.5


def test_what_is_not_on_the_nod_is_not_learned():
    lateness = Lateness(2875.0, 10.0)
    since = np.linspace(0.0, 2500.0, 100)
    lateness.add(since, np.full(100, 2500.0), np.full(100, 0.5))
    assert lateness.progress(since, 2500.0) == pytest.approx(since / 2500.0)
