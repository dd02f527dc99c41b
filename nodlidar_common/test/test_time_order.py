"""Which samples are passed on when stamps go back or leap."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.time_order import LEAST_TO_JUMP, TimeOrder
import pytest

MS, S = 1_000_000, 1_000_000_000
BEGIN_NS = 1_700_000_000 * S


class Order(TimeOrder):
    """An order of which each sample is its own time; counts what it rejects."""

    def __init__(self, **limits):
        super().__init__(self._reject, **limits)
        self.rejected = 0

    def _reject(self):
        self.rejected += 1

    def passed(self, times_ns):
        return [t for time_ns in times_ns for t in self.add(time_ns, time_ns)]


EVEN = [BEGIN_NS + k * 10 * MS for k in range(20)]


def test_what_follows_is_passed_on_at_once():
    assert Order().passed(EVEN) == EVEN


@pytest.mark.parametrize('fall_ns', [0, S])
@pytest.mark.parametrize('wrong_ns', [0, EVEN[3] - S, EVEN[9] + 2 * S, 2**62])
def test_a_single_sample_of_another_time_is_rejected(wrong_ns, fall_ns):
    order = Order(longest_fall_ns=fall_ns)
    assert order.passed([*EVEN[:10], wrong_ns, *EVEN[10:]]) == EVEN
    assert order.rejected == 1


@pytest.mark.parametrize('late_ns', [EVEN[3], EVEN[9] - 1])
def test_a_single_late_sample_is_rejected_if_none_may_be_late(late_ns):
    times_ns = [*EVEN[:10], late_ns, *EVEN[10:]]
    assert Order().passed(times_ns) == EVEN
    assert Order(longest_fall_ns=S).passed(times_ns) == times_ns


@pytest.mark.parametrize('step_ns', [-3600 * S, -500 * MS, -100 * MS, 3600 * S])
def test_another_time_is_believed_with_the_third_sample_and_none_is_lost(step_ns):
    later = [t + step_ns + 200 * MS for t in EVEN]
    order = Order()
    assert order.passed(EVEN + later[:2]) == EVEN
    assert order.passed(later[2:]) == later
    assert order.rejected == 0


def test_samples_seconds_apart_follow_each_other_where_gaps_may_be_so_long():
    slow = [BEGIN_NS + k * 3 * S for k in range(5)]
    assert Order(longest_leap_ns=10 * S).passed(slow) == slow


def test_after_a_silence_a_sample_may_be_later_by_as_much():
    slow = [BEGIN_NS + k * 30 * S for k in range(5)]
    order = Order()
    assert [t for time_ns in slow for t in order.add(time_ns, time_ns, time_ns)] == slow
    assert order.add(slow[-1] + 3 * S, 0, slow[-1] + S) == []


def test_late_samples_do_not_move_what_others_may_be_late_to():
    order = Order(longest_fall_ns=S)
    back = [BEGIN_NS - k * 600 * MS for k in range(4)]
    assert order.passed(back[:2]) == back[:2]
    assert order.passed(back[2:]) == []


@given(st.lists(st.integers(0, 2**62), max_size=60), st.integers(0, 2**61))
def test_whatever_comes_is_passed_on_or_rejected_once(times_ns, fall_ns):
    order = Order(longest_fall_ns=fall_ns)
    sure = order.passed(times_ns)
    order.restart()
    assert len(sure) + order.rejected == len(times_ns)
    falls = sum(b < a - fall_ns for a, b in pairwise(sure))
    assert falls <= len(times_ns) // LEAST_TO_JUMP


@given(st.data())
def test_strays_change_nothing_and_are_rejected_each(data):
    wrong = st.one_of(st.integers(0, EVEN[0] - 2 * S), st.integers(EVEN[-1] + 2 * S, 2**62))
    strays = st.lists(wrong, max_size=LEAST_TO_JUMP - 1)
    order, heard = Order(longest_fall_ns=S), [EVEN[0]]
    for time_ns in EVEN[1:]:
        heard += [*data.draw(strays), time_ns]
    assert order.passed(heard) == EVEN
    assert order.rejected == len(heard) - len(EVEN)
