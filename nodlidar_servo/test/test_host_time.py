import itertools

from nodlidar_servo.host_time import HostTime
import pytest

START_NS = 1_800_000_000_000_000_000


class Clocks:
    """A steady clock on which each reading takes 100 ns, and a host's clock that can be set."""

    def __init__(self):
        self.steady_ns = 0
        self.offset_ns = START_NS

    def steady(self):
        self.steady_ns += 100
        return self.steady_ns

    def host(self):
        return self.steady() + self.offset_ns


@pytest.mark.parametrize('step_ns', [-3600 * 10**9, -(10**9), 2_000_000, 3600 * 10**9])
def test_a_clock_that_is_set_counts_from_the_next_cycle_on(step_ns):
    clocks = Clocks()
    time = HostTime(clocks.host, clocks.steady)
    clocks.offset_ns += step_ns
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=200)
    assert time.follow() == pytest.approx(step_ns, abs=200)
    assert time() == pytest.approx(clocks.steady_ns + START_NS + step_ns, abs=200)
    assert time.follow() == 0


def test_a_clock_that_drifts_is_followed_without_a_word():
    clocks = Clocks()
    time = HostTime(clocks.host, clocks.steady)
    for _ in range(1000):
        clocks.offset_ns += 5000
        assert time.follow() == 0
    assert time() == pytest.approx(clocks.steady_ns + START_NS + 5_000_000, abs=200)


@pytest.mark.parametrize('reading', range(3))
def test_a_host_that_stands_still_between_two_readings_is_no_step(reading):
    clocks = Clocks()
    time = HostTime(clocks.host, clocks.steady)
    count, steady = itertools.count(), clocks.steady

    def stalled():
        clocks.steady_ns += 10**9 if next(count) == reading else 0
        return steady()

    clocks.steady = stalled
    time._steady = stalled
    assert time.follow() == 0
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=300)
