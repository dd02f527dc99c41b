"""The clock of the stamps, against a true clock of another machine."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.inputs.scan_clock import ScanClock
import pytest

S, MS = 1_000_000_000, 1_000_000
PERIOD_NS = 100 * MS
NS = st.integers(-(10**18), 10**18)
WAY_NS = st.lists(st.integers(0, 400 * MS), min_size=1, max_size=120)


@given(offset_ns=NS, host_offset_ns=NS, ways_ns=WAY_NS)
def test_it_is_late_by_the_shortest_way_at_most(offset_ns, host_offset_ns, ways_ns):
    """Of the last 50 scans. Where it takes the host's clock, that is as good to 0.1 s."""
    clock, steady_ns = ScanClock(), 0
    for number, way_ns in enumerate(ways_ns):
        end_ns = number * PERIOD_NS
        steady_ns = max(steady_ns, end_ns + way_ns)
        ways_ns[number] = steady_ns - end_ns
        clock.add(end_ns + offset_ns, steady_ns)
    found = clock.now_ns(steady_ns, steady_ns + host_offset_ns)
    late_ns = steady_ns + offset_ns - found
    shortest_ns = min(ways_ns[-50:])
    assert shortest_ns - 100 * MS <= late_ns <= shortest_ns


def test_before_the_first_scan_it_is_the_host_s():
    assert ScanClock().now_ns(5, 7) == 7


def test_the_host_s_clock_counts_while_it_agrees():
    clock = ScanClock()
    clock.add(1000 * S, 5 * S)
    assert clock.now_ns(6 * S, 1001 * S + 30 * MS) == 1001 * S + 30 * MS
    assert clock.now_ns(6 * S, 1001 * S - 30 * MS) == 1001 * S


@pytest.mark.parametrize('step_ns', [50 * MS, 3600 * S])
def test_it_follows_the_stamps_at_once_when_their_clock_is_set_forward(step_ns):
    clock = ScanClock()
    for number in range(10):
        clock.add(number * S, number * S)
    assert clock.add(10 * S + step_ns, 10 * S)
    assert clock.now_ns(11 * S, 0) == 11 * S + step_ns


@pytest.mark.parametrize('step_ns', [-3600 * S, -2 * S])
@pytest.mark.parametrize('burst', [1, 2, 5])
def test_it_follows_a_clock_that_is_set_back_once_scans_come_at_the_pace_of_their_stamps(
    step_ns, burst
):
    """Scans may come several at a time, with the last of them."""
    clock = ScanClock()
    for number in range(60):
        clock.add(number * PERIOD_NS, number * PERIOD_NS)
    known = [
        clock.add(number * PERIOD_NS + step_ns, (number // burst + 1) * burst * PERIOD_NS)
        for number in range(60, 120)
    ]
    begins = known.index(True)
    assert 2 <= begins <= max(2, burst)
    assert all(known[begins:])
    assert clock.now_ns(0, 0) == step_ns - PERIOD_NS


def test_a_clock_that_is_set_back_again_is_followed():
    clock = ScanClock()
    for number in range(10):
        clock.add(100 * S + number * PERIOD_NS, number * PERIOD_NS)
    known = [
        clock.add(begin_ns + number * PERIOD_NS, number * PERIOD_NS)
        for begin_ns, numbers in ((50 * S, (10, 11)), (0, (12, 13, 14, 15)))
        for number in numbers
    ]
    assert known == [False] * 4 + [True] * 2
    assert clock.ahead_ns == 0


def test_a_shift_is_one_of_all_stamps():
    clock = ScanClock()
    clock.add(S, 0)
    clock.shift(-7 * MS)
    assert clock.now_ns(S, 0) == 2 * S - 7 * MS
