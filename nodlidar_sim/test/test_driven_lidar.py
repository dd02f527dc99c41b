"""Lidars with third-party drivers: the shapes of their scans, and when they come."""

import math

from nodlidar_sim.devices.driven_lidar import DrivenLidar
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS, Revolution
import numpy as np
import pytest

S, MS = 1_000_000_000, 1_000_000
START_NS = 1_700_000_000 * S


def revolution(name, beams, since_ms=2, fetched_ms=100, period=0.1):
    """Return a revolution whose first beam is at START_NS."""
    times_ns, azimuths = OTHER_LIDARS[name].rays(START_NS, beams)
    waited = START_NS + since_ms * MS, START_NS + fetched_ms * MS
    return Revolution(times_ns, azimuths, period, *waited)


@pytest.mark.parametrize(
    ('name', 'beams', 'first', 'last', 'duration', 'lost'),
    [
        ('rplidar', 720, math.pi, -math.pi, 0.1 * 719 / 720, math.inf),
        ('ldlidar', 450, 2.0 * math.pi, 0.0, 449 / 4500, math.nan),
        ('ydlidar', 505, math.pi, -math.pi, 0.1 * 504 / 505, 0.0),
        ('urg_node2', 1081, -0.75 * math.pi, 0.75 * math.pi, 0.025 * 0.75, math.nan),
    ],
)
def test_azimuths_rise_whichever_way_the_lidar_turns(name, beams, first, last, duration, lost):
    done = revolution(name, beams)
    assert (done.times_ns[-1] - done.times_ns[0]) / S == pytest.approx(duration, abs=1e-9)
    assert done.azimuths[[0, -1]] == pytest.approx([first, last])
    ranges = np.linspace(1.0, 2.0, beams)  # in the order of time
    ranges[3:7] = np.nan, np.inf, 0.049, 12.001
    scan = OTHER_LIDARS[name].published(done, ranges)
    assert (scan.angle_min, scan.angle_max) == pytest.approx(sorted([first, last]))
    assert scan.angle_increment == pytest.approx(abs(last - first) / (beams - 1))
    assert (scan.range_min, scan.range_max) == (0.05, 12.0)
    in_time = scan.ranges if last > first else scan.ranges[::-1]
    np.testing.assert_array_equal(in_time[3:7], [lost] * 4)
    assert in_time[[0, 2, 7, -1]] == pytest.approx(ranges[[0, 2, 7, -1]], rel=1e-7)


@pytest.mark.parametrize(
    ('name', 'period', 'stamp_ms', 'scan_time', 'time_increment'),
    [
        ('rplidar', 0.1, 2, 0.098, 0.098 / 9),
        ('ldlidar', 0.1, 100, 0.098, 0.098 / 9),
        ('ydlidar', 0.1, 0, 0.1, 0.01),
        ('ydlidar', 0.0, 0, 0.0, 0.0),  # the first one
        ('urg_node2', 0.1, 0, 0.025, 0.025 / 1440),
    ],
)
def test_times_of_ten_beams(name, period, stamp_ms, scan_time, time_increment):
    done = revolution(name, 10, period=period)
    scan = OTHER_LIDARS[name].published(done, np.ones(10))
    assert scan.stamp_ns == START_NS + stamp_ms * MS
    assert (scan.scan_time, scan.time_increment) == pytest.approx((scan_time, time_increment))


def running(name, seconds, clock_rate=1.0, seed=0):
    """Return what a driver publishes, when, and the times of the beams of each scan."""
    beams_ns, found, arrivals_ns = [], [], []

    def measure(times_ns, azimuths):
        beams_ns.append(times_ns)
        return np.ones(len(times_ns))

    lidar = DrivenLidar(
        OTHER_LIDARS[name], measure, start_ns=START_NS, clock_rate=clock_rate, seed=seed
    )
    while (now_ns := lidar.next_event_ns()) <= START_NS + seconds * S:
        assert lidar.transmit(now_ns - 1) == b''
        assert not lidar.scans
        assert lidar.transmit(now_ns) == b''
        found += lidar.scans
        arrivals_ns += [now_ns] * len(lidar.scans)
        lidar.scans.clear()
        assert lidar.next_event_ns() > now_ns
    return found, np.array(arrivals_ns), beams_ns


@pytest.mark.parametrize(
    ('name', 'period'), [('rplidar', 0.1), ('ydlidar', 0.1), ('urg_node2', 0.025)]
)
def test_revolutions_follow_each_other_by_the_clock_of_the_lidar(name, period):
    scans, arrivals_ns, beams_ns = running(name, 10, clock_rate=1.0005)
    assert len(scans) == pytest.approx(10.0 / period, abs=2)
    first_ns = np.array([times_ns[0] for times_ns in beams_ns])
    np.testing.assert_allclose(np.diff(first_ns) / S, period / 1.0005, atol=2e-9)
    after = (arrivals_ns - [times_ns[-1] for times_ns in beams_ns]) / MS
    assert after.min() >= 0.0
    assert after.max() <= 4.0


def test_an_rplidar_s_stamps_are_late_by_what_usb_was_late_before():
    scans, arrivals_ns, beams_ns = running('rplidar', 20)
    stamps_ns = np.array([scan.stamp_ns for scan in scans])
    np.testing.assert_array_equal(stamps_ns[1:], arrivals_ns[:-1])
    waited = [scan.scan_time for scan in scans[:-1]]
    np.testing.assert_allclose(np.diff(stamps_ns) / S, waited, atol=1e-9)
    late = (stamps_ns - [times_ns[0] for times_ns in beams_ns]) / MS
    assert -0.2 < late.min() < 0.5  # the last beam is one step before the first of the next
    assert late.mean() == pytest.approx(2.0, abs=0.5)


def test_the_first_scan_of_a_ydlidar_says_no_time():
    scans, _, _ = running('ydlidar', 1)
    increments = [scan.time_increment for scan in scans]
    assert increments[0] == 0.0
    assert increments[1:] == pytest.approx([0.1 / 505] * (len(scans) - 1))


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_an_ldlidar_is_polled_ten_times_a_second_and_drifts_against_it(seed):
    scans, arrivals_ns, beams_ns = running('ldlidar', 200, seed=seed)
    stamps_ns = np.array([scan.stamp_ns for scan in scans])
    np.testing.assert_array_equal(stamps_ns, arrivals_ns)
    polls = np.diff(stamps_ns) / (100 * MS)
    np.testing.assert_allclose(polls, np.rint(polls), atol=1e-6)
    assert polls.min() == 1.0
    late = (stamps_ns - [times_ns[-1] for times_ns in beams_ns]) / MS
    assert late.min() > 0.0
    assert late.max() < 104.0
    assert np.ptp(late) > 90.0  # 450.5 beams at 4500 a second: 0.11 ms a revolution
    assert {len(scan.ranges) for scan in scans} == set(range(447, 455))
    # A poll that finds none leaves the next one with twice the time.
    np.testing.assert_allclose([scan.scan_time for scan in scans[1:]], polls / 10.0, atol=1e-9)


def test_scans_that_nobody_takes_are_few():
    lidar = DrivenLidar(
        OTHER_LIDARS['rplidar'], lambda times_ns, _: np.ones(len(times_ns)), start_ns=START_NS
    )
    lidar.transmit(START_NS + 30 * S)
    assert len(lidar.scans) == 10
    assert lidar.scans[-1].stamp_ns > START_NS + 29 * S
