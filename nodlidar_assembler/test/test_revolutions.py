"""The line through the stamps of scans against clocks of which all is known."""

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.inputs.revolutions import Revolutions
import numpy as np
import pytest

BEGIN_NS = 1_800_000_000_000_000_000


def truth(turns, rate):
    """Return when revolutions begin [ns], by a lidar whose clock is fast by a rate."""
    return BEGIN_NS + np.rint(np.asarray(turns) * 1e8 / (1.0 + rate)).astype(np.int64)


def jitter(size, seed):
    return np.random.default_rng(seed).uniform(-5e5, 5e5, size).astype(np.int64)


def fitted(stamps):
    """Return counts, begins [ns] and periods [s] as they were after each stamp."""
    lidar, rows = Revolutions(), []
    for stamp_ns in stamps:
        lidar.add(int(stamp_ns), 0.1)
        rows.append((lidar.count, lidar.begin_ns, lidar.period))
    counts, begins, periods = zip(*rows, strict=True)
    return lidar, np.array(counts), np.array(begins), np.array(periods)


@pytest.mark.parametrize('rate', [5.0, 10.0, 40.0])
@pytest.mark.parametrize('off', [-0.03, 0.03])
def test_a_lidar_is_known_whose_period_is_not_the_stated_one(rate, off):
    lidar, period = Revolutions(), (1.0 + off) / rate
    for turn, late in enumerate(jitter(100, seed=1)):
        lidar.add(BEGIN_NS + round(turn * period * 1e9) + int(late), 1.0 / rate)
    assert lidar.restarts == 0
    assert lidar.count == 99
    assert lidar.period == pytest.approx(period, rel=1e-3)


@settings(max_examples=15)
@given(rate=st.floats(-5e-4, 5e-4), seed=st.integers(0, 1000), missing=st.floats(0.0, 0.5))
def test_every_revolution_is_counted_and_known_better_than_its_stamp(rate, seed, missing):
    turns = np.flatnonzero(np.random.default_rng(seed).random(6000) >= missing)
    lidar, counts, begins, periods = fitted(truth(turns, rate) + jitter(len(turns), seed))
    assert lidar.restarts == 0
    np.testing.assert_array_equal(counts, turns - turns[0])
    error = begins - truth(turns, rate)
    assert np.abs(error).max() <= 1e6  # the width of the jitter: a line of few stamps
    assert np.abs(error[100:]).max() <= 6e5
    # 2 * 0.29 ms / sqrt(300) = 0.033 ms. Lines share their stamps, so many are needed for that.
    assert np.sqrt(np.mean(error[300:] ** 2)) < 6e4
    assert np.abs(periods[300:] * (1.0 + rate) / 0.1 - 1.0).max() < 1e-5


def test_an_hour_later_nothing_has_drifted():
    turns = np.arange(36_000)
    stamps = truth(turns, 2e-4) + jitter(len(turns), 1)
    lidar, counts, begins, _ = fitted(stamps)
    error = begins - truth(turns, 2e-4)
    assert lidar.restarts == 0
    assert counts[-1] == 35_999
    assert np.abs(error[300:]).max() < 2e5
    assert abs(error[600:18_000].mean() - error[18_000:].mean()) < 5e3


def test_without_jitter_the_line_is_the_truth():
    turns = np.arange(1000)
    _, _, begins, periods = fitted(truth(turns, 3e-4))
    assert np.abs(begins[-1] - truth(turns, 3e-4)[-1]) <= 100
    assert periods[-1] == pytest.approx(0.1 / 1.0003, rel=1e-8)


@pytest.mark.parametrize('rate', [-0.01, 0.01])
def test_a_motor_that_is_a_hundredth_off_is_followed(rate):
    turns = np.arange(600)
    lidar, counts, begins, _ = fitted(truth(turns, rate))
    assert lidar.restarts == 0
    np.testing.assert_array_equal(counts, turns)
    assert np.abs(begins - truth(turns, rate))[200:].max() < 1e5


def test_single_wrong_stamps_and_ones_that_go_back_change_nothing():
    stamps = truth(np.arange(400), 0.0)
    wrong = stamps.copy()
    wrong[100] += 30_000_000
    wrong[200] -= 3_600_000_000_000
    wrong[300] = wrong[299]
    lidar, _, begins, _ = fitted(wrong)
    assert lidar.restarts == 0
    np.testing.assert_array_equal(np.delete(begins, [100, 200, 300])[-90:], stamps[-90:])


@pytest.mark.parametrize('shift_ns', [-3_600_000_000_000, 50_000_000, 3_600_037_000_000])
def test_a_lidar_or_a_clock_that_begins_anew_is_followed_after_half_a_second(shift_ns):
    stamps = truth(np.arange(400), 0.0)
    stamps[200:] += shift_ns
    lidar, counts, begins, _ = fitted(stamps)
    assert lidar.restarts == 1
    np.testing.assert_array_equal(begins[204:], stamps[204:])
    np.testing.assert_array_equal(np.diff(counts[204:]), 1)
