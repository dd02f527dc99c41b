"""A time_increment that contradicts the stamps is named with both times, and no other."""

import re

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.plausibility.scan_rate import ScanRate
import numpy as np
import pytest

START_NS = 1_700_000_000 * 10**9


def warning(begins, stated):
    """Return the warning for scans that begin at instants [s] and state times of revolutions."""
    rate = ScanRate()
    for begin, nominal in zip(begins, np.broadcast_to(stated, len(begins)), strict=True):
        rate.add(START_NS + round(begin * 1e9), float(nominal))
    return rate.warning


def begins(period, count=130, sent=1, lost=0.0):
    """Return the beginnings of every n-th revolution, without those that are lost."""
    kept = np.random.default_rng(3).random(count) >= lost
    return (np.arange(count) * period * sent)[kept]


@pytest.mark.parametrize('off', [1.0 / 1.5, 1.4, 1.5, 2.0, 3.7])
@pytest.mark.parametrize('lost', [0.0, 0.2])
def test_both_times_are_named(off, lost):
    text = warning(begins(0.1, lost=lost), 0.1 * off)
    assert re.findall(r'(\d+) ms', text) == ['100', str(round(100 * off))]


def test_half_the_time_is_that_of_a_lidar_that_sends_every_second_scan():
    assert warning(begins(0.1), 0.05) == ''


@given(
    period=st.floats(0.02, 0.5),
    off=st.floats(0.9, 1.1),
    sent=st.integers(1, 4),
    lost=st.floats(0.0, 0.5),
)
def test_from_five_percent_on_it_is_named(period, off, sent, lost):
    text = warning(begins(period, 200, sent, lost), off * period)
    if abs(off - 1.0) < 0.045:
        assert text == ''
    if abs(off - 1.0) > 0.055:
        assert 'time_increment' in text


def test_a_motor_that_wanders_or_changes_its_speed_is_not_named():
    speed = np.where(np.arange(130) < 60, 1.0, 0.6) * (1.0 + 0.02 * np.sin(np.arange(130)))
    periods = 0.1 / speed
    assert warning(np.cumsum(periods), periods) == ''
    assert warning(np.cumsum(periods), 0.1) != ''


def test_jitter_single_wrong_stamps_and_time_that_goes_back_are_not_named():
    off = np.random.default_rng(2).normal(0.0, 0.01, 130)
    off[::9] += 0.05
    off[90:] -= 3600.0
    assert warning(begins(0.1) + off, 0.1) == ''


def test_few_scans_or_such_that_state_no_time_are_not_named():
    assert warning(begins(0.1), 0.0) == ''
    assert warning(begins(0.1, 20), 0.15) == ''
    assert warning(np.zeros(100), 0.1) == ''
