"""Stamps of samples that are taken with a steady period."""

from nodlidar_common.steady_stamps import SteadyStamps
import numpy as np

START_NS, PERIOD_NS = 1_700_000_000_000_000_000, 20_000_000
TRUE_NS = START_NS + PERIOD_NS * np.arange(500)


def steadied(stamps_ns, period_ns=PERIOD_NS):
    """Return what becomes of stamps."""
    stamps = SteadyStamps(period_ns)
    return np.array([stamps.of(int(each)) for each in stamps_ns])


def test_steady_stamps_stay_as_they_are():
    np.testing.assert_array_equal(steadied(TRUE_NS), TRUE_NS)


def test_without_a_period_stamps_stay_as_they_are():
    stamps_ns = [5, 9, 3, 3]
    np.testing.assert_array_equal(steadied(stamps_ns, 0), stamps_ns)


def test_jitter_of_arrival_becomes_a_delay():
    """That of an exponential distribution is its median, log 2 times its mean."""
    late_ns = np.random.default_rng(1).exponential(20e6, len(TRUE_NS)).astype(np.int64)
    off_ns = steadied(np.sort(TRUE_NS + late_ns)) - TRUE_NS
    assert np.std(off_ns[25:]) < 20e6 / 3.0
    assert 10e6 < np.mean(off_ns[25:]) < 40e6


def test_instants_ascend_however_the_stamps_are():
    jitter_ns = np.random.default_rng(1).normal(0.0, 40e6, len(TRUE_NS)).astype(np.int64)
    assert (np.diff(steadied(TRUE_NS + jitter_ns)) > 0).all()


def test_a_period_that_is_a_little_off_is_followed():
    assert np.abs(steadied(TRUE_NS, round(PERIOD_NS * 1.002)) - TRUE_NS).max() < 1e6


def test_lost_samples_are_noticed_within_half_of_those_compared():
    off_ns = steadied(np.delete(TRUE_NS, slice(100, 103))) - np.delete(TRUE_NS, slice(100, 103))
    assert off_ns[100] == -3 * PERIOD_NS
    assert not off_ns[113:].any()


def test_after_a_pause_and_when_time_goes_back_the_line_begins_anew():
    for leap_ns in (10**9, -(10**9)):
        stamps_ns = TRUE_NS + leap_ns * (np.arange(len(TRUE_NS)) >= 100)
        np.testing.assert_array_equal(steadied(stamps_ns), stamps_ns)


def test_a_repeated_stamp_is_of_the_same_instant():
    repeated_ns = np.repeat(TRUE_NS, 2)
    np.testing.assert_array_equal(steadied(repeated_ns), repeated_ns)
