"""When an input is silent, by the time that usually passes between its messages."""

from nodlidar_common.silence import LEAST_SILENCE, Silence
import pytest

S = 1_000_000_000


def heard(period, count=100, **first):
    silence = Silence(**first)
    for k in range(count):
        silence.heard(round(k * period * S))
    return silence, round((count - 1) * period * S)


@pytest.mark.parametrize('period', [0.01, 0.1])
def test_silence_is_told_after_half_a_second(period):
    silence, last_ns = heard(period)
    assert silence.seconds(last_ns + round((LEAST_SILENCE - 0.01) * S)) == 0.0
    assert silence.seconds(last_ns + round((LEAST_SILENCE + 0.01) * S)) == pytest.approx(0.51)


@pytest.mark.parametrize('count', [2, 100])
@pytest.mark.parametrize('period', [0.5, 1.47, 6.1])  # the last: sweeps of an LD19
def test_where_messages_come_slowly_it_takes_longer(period, count):
    silence, last_ns = heard(period, count)
    assert silence.seconds(last_ns + round(3.9 * period * S)) == 0.0
    assert silence.seconds(last_ns + round(4.1 * period * S)) == pytest.approx(4.1 * period)


def test_after_the_first_message_alone_nobody_knows_what_is_usual():
    silence, last_ns = heard(1.0, count=1, first=10.0)
    assert silence.seconds(last_ns + round(9.9 * S)) == 0.0
    assert silence.seconds(last_ns + round(10.1 * S)) == pytest.approx(10.1)
    usual, last_ns = heard(1.0, count=1)
    assert usual.seconds(last_ns + round(0.51 * S)) == pytest.approx(0.51)


def test_a_silence_is_over_with_the_next_message_and_does_not_count_as_usual():
    silence, last_ns = heard(0.1)
    silence.heard(last_ns + 60 * S)
    assert silence.seconds(last_ns + 60 * S) == 0.0
    assert silence.seconds(last_ns + round(60.6 * S)) == pytest.approx(0.6)


@pytest.mark.parametrize('stall', [9.0, 20.0])
def test_messages_that_waited_for_a_process_do_not_make_their_interval_seem_short(stall):
    """Sweeps of 1.5 s, the process stood still: those of meanwhile come at once."""
    silence, period = Silence(10.0), 1.5
    arrivals = [k * period for k in range(10)]
    begin = arrivals[-1]
    end = begin + stall
    arrivals += [end] * int(stall / period)
    for k, arrival in enumerate(arrivals):
        silence.heard(round(arrival * S), round(k * period * S))
    for k in range(len(arrivals), len(arrivals) + 10):
        arrival_ns = round(k * period * S)  # as ever
        assert silence.seconds(arrival_ns - 1) == 0.0
        silence.heard(arrival_ns, arrival_ns)
    assert silence.seconds(arrival_ns + 7 * S) == pytest.approx(7.0)


def test_where_simulated_time_is_slow_that_of_the_host_is_usual():
    """Scans at 10 Hz of a simulation that takes ten times as long: one each second."""
    silence = Silence()
    for k in range(10):
        silence.heard(k * S, round(0.1 * k * S))
        assert silence.seconds(k * S + round(0.45 * S)) == 0.0
    assert silence.seconds(9 * S + round(3.9 * S)) == 0.0
    assert silence.seconds(9 * S + round(4.1 * S)) == pytest.approx(4.1)


def test_what_never_came_is_not_silent():
    assert Silence().seconds(3600 * S) == 0.0
