"""Publishers of one topic, told apart by sequence numbers, and the messages lost on the way."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.publishers import MOST_LOST, MOST_STREAMS, Publishers
import pytest

S = 10**9


def heard(numbers, period_ns=S // 100):
    """Return the publishers of messages with these numbers, one in each period."""
    publishers = Publishers()
    for k, number in enumerate(numbers):
        publishers.note(publishers.add(number), k * period_ns)
    return publishers


def shared(*sources):
    """Return for each message in time whether several publishers are active, and its source.

    Parameters
    ----------
    *sources
        Of each one the times of its messages [s], and the number of the first.
    """
    publishers = Publishers()
    messages = [
        (time, number, source)
        for source, (times, first) in enumerate(sources)
        for number, time in enumerate(times, first)
    ]
    found = []
    for time, number, source in sorted(messages):
        publishers.note(publishers.add(number), round(time * S))
        found.append((publishers.active > 1, source))
    return found


def test_nothing_is_lost_of_one_that_is_heard_from_somewhere_on():
    publishers = heard(range(500, 600))
    assert (publishers.lost, publishers.active) == (0, 1)


@given(st.sets(st.integers(2, 300), max_size=100))
def test_every_missing_number_is_lost(missing):
    assert heard(k for k in range(1, 302) if k not in missing).lost == len(missing)


def test_one_that_begins_anew_is_neither_a_loss_nor_a_second_one():
    publishers = heard([*range(1, 200), *range(1, 40)])
    assert (publishers.lost, publishers.active) == (0, 1)


def test_a_second_one_is_noticed_and_costs_no_losses_and_is_forgotten_when_it_ends():
    both = [n for k in range(50) for n in (5000 + k, 1 + k)]
    publishers = heard(both)
    assert (publishers.lost, publishers.active) == (0, 2)
    for k in range(110):
        publishers.note(publishers.add(5050 + k), S + k * S // 100)
    assert publishers.active == 1


@pytest.mark.parametrize('first', [1, 5, 700, 5000])
@pytest.mark.parametrize('rate', [0.12, 0.2, 0.5, 0.9, 1.0, 1.1, 2.0, 5.0, 30.0])
def test_a_slow_second_one_is_noticed_from_its_second_message_to_its_end(rate, first):
    """The other one sends at 100 Hz, before and after."""
    slow = [(20.003 + k / rate, k) for k in range(round(40 * rate))]
    found = shared(
        ([k / 100 for k in range(8000)], 1_000_000), ([time for time, _ in slow], first)
    )
    of_slow = [k for k, (_, source) in enumerate(found) if source]
    second, last = of_slow[1], of_slow[-1]
    assert not any(several for several, _ in found[:second])
    assert all(several for several, _ in found[second:last])
    until = last + round(100 * max(1.0, min(2.0 / rate, 10.0))) + 2
    assert not any(several for several, _ in found[until:])


def test_a_single_message_of_another_one_now_and_then_is_no_second_one():
    found = shared(([k / 100 for k in range(9000)], 1), ([5.003, 20.003, 40.003], 10**6))
    assert not any(several for several, _ in found)


@given(
    lives=st.lists(st.tuples(st.floats(0.05, 3.0), st.floats(0.0, 2.0)), min_size=2, max_size=8)
)
def test_one_that_restarts_again_and_again_is_never_several(lives):
    """It sends at 100 Hz for some time, and pauses, each time."""
    begin, sources = 0.0, []
    for life, pause in lives:
        count = round(life * 100)
        sources.append(([begin + k / 100 for k in range(count)], 1))
        begin += count / 100 + pause
    assert not any(several for several, _ in shared(*sources))


def test_after_the_clock_was_set_back_the_last_seconds_do_not_count():
    publishers = Publishers()
    for k in range(50):
        for first in (1, 5000):
            publishers.note(publishers.add(first + k), 3600 * S + k * S // 100)
    assert publishers.active == 2
    publishers.note(publishers.add(51), 0)
    assert publishers.active == 1


def test_a_middleware_without_numbers_tells_nothing():
    publishers = heard([None, 2**64 - 1, 0] * 5)
    assert (publishers.lost, publishers.active) == (0, 1)


@given(st.lists(st.integers(0, 2**64 - 1), max_size=300))
def test_whatever_the_numbers_little_is_kept(numbers):
    publishers = heard(numbers)
    assert publishers.lost <= len(numbers) * MOST_LOST
    assert len(publishers._streams) <= MOST_STREAMS
