"""Timer, revolutions and the line of earliest arrivals: the parts of the device clock."""

from hypothesis import assume, given
from hypothesis import strategies as st
from nodlidar_driver.clock.envelope import least, lower_line
import nodlidar_driver.clock.revolution as module
from nodlidar_driver.clock.revolution import fit_truncated, RevolutionTimes
from nodlidar_driver.clock.timer import unwrapped
import numpy as np
import pytest

WRAP = 2**24


@given(st.lists(st.integers(1, 8_000_000), min_size=1, max_size=50), st.integers(0, WRAP - 1))
def test_the_timer_ascends_through_every_wrap(steps, start):
    values = [start]
    for step in steps:
        values.append(unwrapped((values[-1] + step) % WRAP, values[-1]))
    assert list(np.diff(values)) == steps


@given(st.integers(0, 10 * WRAP), st.integers(1 - WRAP // 2, WRAP // 2 - 1))
def test_the_timer_may_go_back(value, step):
    assert unwrapped((value + step) % WRAP, value) == value + step


@given(st.floats(98.0, 102.0), st.floats(0.0, 1.0, exclude_max=True), st.integers(2, 120))
def test_truncated_instants_are_found_within_what_their_stamps_allow(period, phase, count):
    turns = np.arange(1 - count, 1)
    truth = phase + period * turns
    stamps = np.floor(truth).astype(np.int64)
    even = fit_truncated(turns, stamps, 0.02)
    fitted = even.time + even.period * turns
    assert np.all(fitted >= stamps - 0.021)
    assert np.all(fitted <= stamps + 1.021)


@pytest.mark.parametrize('seed', range(20))
def test_of_many_scans_those_that_bound_no_line_change_nothing(monkeypatch, seed):
    random = np.random.default_rng(seed)
    turns = np.unique(random.integers(-1500, 0, 1200))
    turns -= turns[-1]
    wander = random.uniform(0.0, 0.02, len(turns))
    stamps = np.floor(random.random() + random.uniform(24.9, 25.1) * turns + wander).astype(int)
    found = fit_truncated(turns, stamps - stamps[-1], 0.05)
    monkeypatch.setattr(module, '_MANY', len(turns))
    assert found == fit_truncated(turns, stamps - stamps[-1], 0.05) is not None


def test_no_line_explains_uneven_stamps():
    assert fit_truncated(np.array([-2, -1, 0]), np.array([-200, -95, 0]), 0.05) is None


@pytest.mark.parametrize('period', [99.37, 99.9, 100.03, 100.27])
@pytest.mark.parametrize('phase', [0.0, 0.31, 0.77])
def test_revolutions_give_the_fraction_that_the_stamps_lack(period, phase):
    revolution, truth = RevolutionTimes(100.0), 1000.0 + phase + period * np.arange(160)
    fitted = np.array([revolution.add(int(t))[-1] for t in truth])
    assert np.abs(fitted - truth)[100:].max() < 0.15
    assert revolution.period_ms == pytest.approx(period, abs=0.005)


@pytest.mark.parametrize('period', [25.0037, 24.9963, 25.002])
@pytest.mark.parametrize('phase', [0.0, 0.31, 0.77])
def test_fractions_that_cover_a_millisecond_in_seconds_are_found(period, phase):
    revolution, truth = RevolutionTimes(25.0), 1000.0 + phase + period * np.arange(2500)
    fitted = np.array([revolution.add(int(t))[-1] for t in truth])
    assert np.abs(fitted - truth)[1200:].max() < 0.2
    assert revolution.period_ms == pytest.approx(period, abs=1e-4)


def test_revolutions_of_whole_milliseconds_stay_in_the_middle_of_theirs():
    revolution = RevolutionTimes(100.0)
    times = [revolution.add(1000 + 100 * k)[-1] for k in range(50)]
    np.testing.assert_allclose(times, 1000.5 + 100.0 * np.arange(50), atol=1e-6)


@pytest.mark.parametrize('new', [99.61, 93.37, 110.43])
def test_a_motor_that_changes_its_speed_is_followed(new):
    revolution = RevolutionTimes(100.0)
    periods = np.concatenate((np.full(50, 100.03), np.full(60, new)))
    truth = 1000.0 + np.cumsum(periods)
    fitted = np.array([revolution.add(int(t))[-1] for t in truth])
    assert np.abs(fitted - truth).max() < 1.1
    assert np.abs(fitted - truth)[-20:].max() < 0.15
    assert revolution.period_ms == pytest.approx(new, abs=0.01)


@pytest.mark.parametrize('slope', [-450e-6, -30e-6, 0.0, 120e-6, 450e-6])
def test_the_lower_line_finds_drift_under_one_sided_noise(slope):
    x = 100.0 * np.arange(300)
    lines = []
    for seed in range(30):
        late = np.random.default_rng(seed).exponential(3.0, 300)
        lines.append(lower_line(x, 7.0 + slope * (x - x[-1]) + late, x[-1]))
    slopes, values = np.array([(line.slope, line.value) for line in lines]).T
    assert np.sqrt(np.mean((slopes - slope) ** 2)) < 3e-6
    assert np.sqrt(np.mean((values - 7.0) ** 2)) < 0.06
    assert np.mean([line.scatter for line in lines]) == pytest.approx(3.0, rel=0.05)


def test_few_points_do_not_tilt_the_line():
    assert abs(lower_line(np.array([0.0, 100.0]), np.array([5.0, 0.0]), 100.0).slope) < 100e-6
    assert lower_line(np.array([0.0]), np.array([5.0]), 0.0).value == 5.0


def test_the_least_delay_is_estimated_without_bias():
    random = np.random.default_rng(1)
    estimates = [least(10.0 + random.exponential(3.0, 24)) for _ in range(2000)]
    assert np.mean(estimates) == pytest.approx(10.0, abs=0.01)


@given(st.floats(-1e6, 1e6), st.lists(st.floats(0.0, 50.0), min_size=2, max_size=50))
def test_the_lower_line_is_lifted_with_its_points(height, delays):
    x, y = 100.0 * np.arange(len(delays)), np.array(delays)
    assume(y.max() - y.min() > 1e-3)
    lifted = lower_line(x, y + height, 0.0)
    assert lifted.value - height == pytest.approx(lower_line(x, y, 0.0).value, abs=1e-2)
