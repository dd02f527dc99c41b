"""The bracketing filter in virtual time: what it releases, holds and drops, and in which order."""

from hypothesis import given
from hypothesis import strategies as st
from message_filters import SimpleFilter
from nodlidar_assembler.filters.bracket_filter import BracketFilter
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import LaserScan

MS = 1_000_000
START = 1_700_000_000_000 * MS
DURATION = 66 * MS


class Bench:
    """A bracketing filter between hand-fed inputs and lists of what came out."""

    def __init__(self, deadline=0.3, margin=0):
        self.now = START
        self.scans, self.joint_filter = SimpleFilter(), SimpleFilter()
        self.released, self.dropped = [], []
        self.filter = BracketFilter(
            self.scans,
            self.joint_filter,
            lambda scan: DURATION,
            deadline,
            lambda: self.now,
            lambda scan, reason: self.dropped.append((ms_of(scan), reason)),
            margin * MS,
        )
        self.filter.registerCallback(
            lambda scan, samples: self.released.append((ms_of(scan), in_ms(samples.time_ns)))
        )

    def scan(self, ms):
        message = LaserScan()
        message.header.stamp = time_message(START + ms * MS)
        self.scans.signalMessage(message)

    def joint(self, ms):
        self.joint_filter.signalMessage(START + ms * MS, 0.1)


def ms_of(scan):
    return (time_ns(scan.header.stamp) - START) // MS


def in_ms(times_ns):
    return ((times_ns - START) // MS).tolist()


def test_a_scan_waits_for_the_joint_state_after_its_last_beam():
    bench = Bench()
    bench.joint(0)
    bench.scan(10)
    bench.joint(20)
    bench.joint(75)
    assert bench.released == []
    bench.joint(80)
    assert bench.released == [(10, [0, 20, 75, 80])]


def test_a_scan_that_comes_last_leaves_at_once_with_no_more_than_its_bracket():
    bench = Bench()
    for ms in range(0, 200, 10):
        bench.joint(ms)
    bench.scan(45)
    assert bench.released == [(45, [40, 50, 60, 70, 80, 90, 100, 110, 120])]


def test_without_a_joint_state_before_it_a_scan_is_dropped():
    bench = Bench()
    bench.joint(20)
    bench.scan(10)
    bench.joint(80)
    assert bench.dropped == [(10, BracketFilter.NO_HISTORY)]


def test_at_the_deadline_a_scan_is_dropped_and_the_next_one_is_kept():
    bench = Bench(deadline=0.3)
    bench.joint(0)
    bench.scan(10)
    bench.now += 250 * MS
    bench.scan(100)
    bench.now += 51 * MS
    bench.filter.release()
    assert bench.dropped == [(10, BracketFilter.LATE)]
    bench.joint(170)
    assert bench.released == [(100, [0, 170])]


@given(st.permutations([('scan', 100 * k) for k in range(5)] + [('joint', 0), ('joint', 600)]))
def test_whatever_the_order_every_scan_is_released_or_dropped_once_and_in_order(arrivals):
    bench = Bench()
    for kind, ms in arrivals:
        getattr(bench, kind)(ms)
    bench.now += 10_000 * MS
    bench.filter.release()
    left = [ms for ms, _ in bench.released] + [ms for ms, _ in bench.dropped]
    assert sorted(left) == [0, 100, 200, 300, 400]
    order = [ms for kind, ms in arrivals if kind == 'scan']
    assert [ms for ms, _ in bench.released] == [m for m in order if m in dict(bench.released)]


def test_when_time_goes_back_no_old_joint_state_brackets_a_new_scan():
    bench = Bench()
    for ms in range(10_000, 10_200, 10):
        bench.joint(ms)
    bench.scan(10_180)
    for ms in range(0, 200, 10):
        bench.joint(ms)
    bench.scan(45)
    assert bench.dropped == [(10_180, BracketFilter.TIME_WENT_BACK)]
    assert bench.released == [(45, list(range(40, 130, 10)))]


def test_with_a_margin_a_scan_waits_for_it_and_brings_the_states_of_it():
    bench = Bench(margin=50)
    for ms in range(0, 200, 20):
        bench.joint(ms)
    bench.scan(75)
    assert bench.released == []
    bench.joint(200)
    assert bench.released == [(75, list(range(20, 201, 20)))]


def test_where_the_margin_is_missing_a_scan_leaves_at_the_deadline_with_its_bracket():
    bench = Bench(margin=50, deadline=0.3)
    for ms in range(40, 161, 20):
        bench.joint(ms)
    bench.scan(75)
    bench.now += 301 * MS
    bench.filter.release()
    assert bench.dropped == []
    assert bench.released == [(75, list(range(40, 161, 20)))]


def test_a_margin_does_not_replace_the_bracket():
    bench = Bench(margin=50, deadline=0.3)
    for ms in range(80, 141, 20):
        bench.joint(ms)
    bench.scan(75)
    bench.joint(160)
    bench.joint(200)
    bench.scan(145)
    bench.now += 301 * MS
    bench.filter.release()
    assert bench.released == []
    assert bench.dropped == [(75, BracketFilter.NO_HISTORY), (145, BracketFilter.LATE)]


def test_a_clock_that_is_set_back_makes_no_scan_wait_without_end():
    bench = Bench()
    bench.joint(0)
    bench.scan(10)
    bench.now -= 3600_000 * MS
    bench.filter.release()
    assert bench.dropped == [(10, BracketFilter.LATE)]
