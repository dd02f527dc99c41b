"""The odometry filter in virtual time: what it releases, holds and gives up, in which order."""

import math

from hypothesis import given
from hypothesis import strategies as st
from message_filters import SimpleFilter
from nodlidar_assembler.clouds.ego_motion import MotionLimits
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.filters.odometry_filter import OdometryFilter
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import time_ns
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan

MS = 1_000_000
START = 1_700_000_000_000 * MS
DURATION = 66 * MS
UNTURNED = (0.0, 0.0, 0.0, 1.0)


class Bench:
    """An odometry filter between hand-fed inputs and lists of what came out."""

    def __init__(self):
        self.now = START
        self.scans, self.history = SimpleFilter(), OdometryHistory()
        self.released, self.missing = [], []
        self.filter = OdometryFilter(
            self.scans,
            self.history,
            lambda scan: DURATION,
            0.3,
            lambda: self.now,
            lambda scan, states, reason: self.missing.append((ms_of(scan), states, reason)),
        )
        self.filter.registerCallback(
            lambda scan, states, odometry: self.released.append((ms_of(scan), states, odometry))
        )

    def scan(self, ms, states=()):
        message = LaserScan()
        message.header.stamp = time_message(START + ms * MS)
        self.scans.signalMessage(message, states)

    def odometry(self, ms, x=0.0):
        self.history.add(START + ms * MS, (x, 0.0, 0.0), UNTURNED)
        self.filter.release()

    def released_ms(self):
        return [(ms, list((o.time_ns - START) // MS)) for ms, _, o in self.released]


def ms_of(message):
    return (time_ns(message.header.stamp) - START) // MS


def test_a_scan_waits_for_the_odometry_after_its_last_beam():
    bench = Bench()
    for ms in (-20, 0):
        bench.odometry(ms)
    bench.scan(10, states=['a'])
    for ms in (20, 40, 60):
        bench.odometry(ms)
    assert not bench.released
    bench.odometry(80)
    assert bench.released_ms() == [(10, [0, 20, 40, 60, 80])]
    assert bench.released[0][1] == ['a']


def test_samples_at_the_first_and_last_beam_bracket_it():
    bench = Bench()
    for ms, x in ((-20, 0.0), (0, 1.0), (66, 2.0)):
        bench.odometry(ms, x)
    bench.scan(0)
    assert bench.released_ms() == [(0, [0, 66])]
    assert np.array_equal(bench.released[0][2].poses.position[:, 0], [1.0, 2.0])


def test_the_newest_sample_comes_with_the_scan():
    bench = Bench()
    for ms in (0, 66, 100, 120):
        bench.odometry(ms)
    bench.scan(0)
    assert bench.released_ms() == [(0, [0, 66, 100, 120])]


def test_without_odometry_before_it_a_scan_is_given_up_at_once():
    bench = Bench()
    bench.scan(10, states=['a'])
    bench.odometry(20)
    bench.odometry(80)
    assert bench.missing == [(10, ['a'], OdometryFilter.NO_HISTORY)]


def test_at_the_deadline_a_scan_is_given_up_and_the_next_one_is_kept():
    bench = Bench()
    bench.odometry(0)
    bench.scan(10)
    bench.now += 250 * MS
    bench.scan(100)
    bench.now += 51 * MS
    bench.filter.release()
    assert bench.missing == [(10, (), OdometryFilter.LATE)]
    bench.odometry(170)
    assert bench.released_ms() == [(100, [0, 170])]


def test_without_any_odometry_every_scan_is_given_up():
    bench = Bench()
    bench.scan(10)
    bench.now += 301 * MS
    bench.filter.release()
    assert bench.missing == [(10, (), OdometryFilter.LATE)]


def test_when_time_goes_back_what_waits_is_given_up_and_nothing_old_is_used():
    bench = Bench()
    bench.odometry(10_000)
    bench.scan(10_010)
    bench.history.clear()
    bench.filter.forget()
    for ms in (0, 50, 100, 150):
        bench.odometry(ms)
    bench.scan(45)
    assert bench.missing == [(10_010, (), OdometryFilter.TIME_WENT_BACK)]
    assert bench.released_ms() == [(45, [0, 50, 100, 150])]


def test_odometry_that_is_not_finite_is_a_reason():
    bench = Bench()
    bench.odometry(0)
    bench.odometry(70, math.inf)
    bench.scan(0)
    assert bench.missing == [(0, (), 'odometry that is not finite')]


@given(st.lists(st.integers(0, 30_000), max_size=60))
def test_the_history_has_the_last_10_s_of_what_was_newer_each_time(stamps):
    history, expected = OdometryHistory(), []
    for ms in stamps:
        history.add(START + ms * MS, (float(ms), 0.0, 0.0), UNTURNED)
        if not expected or ms > expected[-1]:
            expected = [old for old in expected if old >= ms - 10_000] + [ms]
    kept = history.around(START, START + 30_000 * MS)
    assert list((kept.time_ns - START) // MS) == expected
    assert list(kept.poses.position[:, 0]) == expected


@pytest.mark.parametrize(('ms', 'around'), [(0, [0, 20]), (20, [20, 40]), (40, [20, 40])])
def test_an_instant_at_a_sample_has_another_one_beside_it(ms, around):
    history, at_ns = OdometryHistory(), START + ms * MS
    for each in (0, 20, 40):
        history.add(START + each * MS, (float(each), 0.0, 0.0), UNTURNED)
    kept = history.around(at_ns, at_ns)
    assert list((kept.time_ns - START) // MS) == around
    limits = MotionLimits(max_gap=0.1, max_speed=math.inf, max_turn_rate=math.inf)
    assert kept.at(np.array([at_ns]), limits).position[0, 0] == ms


@given(st.permutations([('scan', 100 * k) for k in range(5)]), st.integers(0, 5))
def test_every_scan_is_released_or_given_up_once_and_in_order(arrivals, when):
    bench = Bench()
    bench.odometry(0)
    for k, (_, ms) in enumerate(arrivals):
        if k == when:
            bench.odometry(600)
        bench.scan(ms)
    bench.now += 10_000 * MS
    bench.filter.release()
    order = [ms for _, ms in arrivals]
    out = bench.missing if when == 5 else bench.released
    assert [entry[0] for entry in out] == order
    assert len(bench.missing) + len(bench.released) == 5
