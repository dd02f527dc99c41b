"""The host's clock against one that goes on evenly."""

import itertools

from nodlidar_common.host_time import HostTime, SteadyTime
import numpy as np
import pytest

MS, S = 1_000_000, 1_000_000_000
START_NS = 1_700_000_000 * S


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

    def wait(self, duration_ns, rate=0.0):
        self.steady_ns += duration_ns
        self.offset_ns += round(duration_ns * rate)


@pytest.fixture
def clocks():
    return Clocks()


@pytest.mark.parametrize(
    'step_ns', [-3600 * S, -25 * S, -20 * MS, -2 * MS, 2 * MS, 50 * MS, 3600 * S]
)
def test_a_clock_that_is_set_counts_from_the_next_update_on(clocks, step_ns):
    time = HostTime(clocks.host, clocks.steady)
    clocks.offset_ns += step_ns
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=200)
    assert time.update() == pytest.approx(step_ns, abs=200)
    assert time() == pytest.approx(clocks.steady_ns + START_NS + step_ns, abs=200)
    assert [time.update() for _ in range(3)] == [0] * 3


@pytest.mark.parametrize('rate', [-5e-4, 5e-4])
@pytest.mark.parametrize('pause_ns', [10 * MS, S, 3600 * S])
def test_a_clock_that_is_corrected_slowly_is_followed_without_a_word(clocks, rate, pause_ns):
    time = HostTime(clocks.host, clocks.steady)
    for _ in range(1000):
        clocks.wait(pause_ns, rate)
        assert time.update() == 0
    assert time() == pytest.approx(clocks.steady_ns + clocks.offset_ns, abs=200)


@pytest.mark.parametrize('reading', range(3))
def test_a_host_that_stands_still_between_two_readings_is_no_step(clocks, reading):
    time = HostTime(clocks.host, clocks.steady)
    count, steady = itertools.count(), clocks.steady

    def stopped_once():
        if next(count) == reading:
            clocks.wait(3 * S)
        return steady()

    clocks.steady = time._steady = stopped_once
    for _ in range(3):
        assert time.update() == 0
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=500)


def test_a_busy_host_s_clocks_are_read_where_it_was_least_busy(clocks):
    busy = iter([40 * MS, 3 * MS, 1_000, 50 * MS])

    def host():
        shown = clocks.host()
        clocks.wait(next(busy))
        return shown

    assert HostTime(host, clocks.steady).ahead_ns == pytest.approx(START_NS, abs=1_000)


def test_while_the_clocks_cannot_be_read_at_once_the_former_time_goes_on(clocks):
    time = HostTime(clocks.host, clocks.steady)
    host = clocks.host
    time._clock = lambda: (clocks.wait(5 * MS), host(), clocks.wait(5 * MS))[1]
    assert [time.update() for _ in range(10)] == [0] * 10
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=200)


def test_a_first_reading_that_was_not_at_once_is_mended_without_a_word(clocks):
    host = clocks.host
    time = HostTime(lambda: (host(), clocks.wait(5 * MS))[0], clocks.steady)
    time._clock = host
    assert time.update() == 0
    assert time() == pytest.approx(clocks.steady_ns + START_NS, abs=200)


@pytest.mark.parametrize('slew', [-0.08, -5e-4, 5e-4, 0.08])
def test_raw_times_are_steady_ones_also_of_before_the_steady_clock_was_slewed(clocks, slew):
    """Here the host's clock is the steady one, and the clocks' steady one is the raw one."""
    time = SteadyTime(clocks.host, clocks.steady)
    raw_ns, steady_ns = [], []
    for rate in (0.0, slew, 0.0):
        for _ in range(30):
            clocks.wait(70 * MS, rate)
            raw_ns.append(clocks.steady_ns)
            steady_ns.append(clocks.steady_ns + clocks.offset_ns)
            clocks.wait(30 * MS, rate)
            time.update()
            now = time(np.array(raw_ns[-1:]))
            assert now == pytest.approx(steady_ns[-1:], abs=1_000)
    np.testing.assert_allclose(
        time(np.array(raw_ns)) - START_NS, np.array(steady_ns) - START_NS, atol=1_000
    )


def test_raw_times_of_before_the_first_reading_are_as_much_ahead(clocks):
    time = SteadyTime(clocks.host, clocks.steady)
    before_ns = clocks.steady_ns - S
    assert time(np.array([before_ns])) == pytest.approx([before_ns + START_NS], abs=200)
