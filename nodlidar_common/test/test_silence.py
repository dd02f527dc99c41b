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


def test_what_never_came_is_not_silent():
    assert Silence().seconds(3600 * S) == 0.0
