"""Publishers of one topic, told apart by sequence numbers, and the messages lost on the way."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.publishers import MOST_LOST, MOST_STREAMS, Publishers


def heard(numbers):
    publishers = Publishers()
    for number in numbers:
        publishers.note(publishers.add(number))
    return publishers


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
    for number in range(5050, 5160):
        publishers.note(publishers.add(number))
    assert publishers.active == 1


def test_a_middleware_without_numbers_tells_nothing():
    publishers = heard([None, 2**64 - 1, 0] * 5)
    assert (publishers.lost, publishers.active) == (0, 1)


@given(st.lists(st.integers(0, 2**64 - 1), max_size=300))
def test_whatever_the_numbers_little_is_kept(numbers):
    publishers = heard(numbers)
    assert publishers.lost <= len(numbers) * MOST_LOST
    assert len(publishers._streams) <= MOST_STREAMS
