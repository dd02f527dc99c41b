"""Which joint samples are passed on when stamps go back or leap."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.joint_order import JointOrder, LEAST_TO_JUMP
import pytest

MS, S = 1_000_000, 1_000_000_000
BEGIN_NS = 1_700_000_000 * S


def passed(times_ns, order=None):
    order = order or JointOrder()
    return order, [t for time_ns in times_ns for t, _ in order.add(time_ns, 0.0)]


EVEN = [BEGIN_NS + k * 10 * MS for k in range(20)]


def test_what_follows_is_passed_on_at_once():
    assert passed(EVEN)[1] == EVEN


@pytest.mark.parametrize('wrong_ns', [0, EVEN[3], EVEN[9] - 1, EVEN[9] + 2 * S, 2**62])
def test_a_single_sample_of_another_time_is_rejected(wrong_ns):
    order, times_ns = passed([*EVEN[:10], wrong_ns, *EVEN[10:]])
    assert times_ns == EVEN
    assert order.rejected == 1


@pytest.mark.parametrize('step_ns', [-3600 * S, -500 * MS, -100 * MS, 3600 * S])
def test_another_time_is_believed_with_the_third_sample_and_none_is_lost(step_ns):
    later = [t + step_ns + 200 * MS for t in EVEN]
    order, times_ns = passed(EVEN + later)
    assert times_ns == EVEN + later
    assert order.rejected == 0


def test_samples_seconds_apart_follow_each_other_where_gaps_may_be_so_long():
    slow = [BEGIN_NS + k * 3 * S for k in range(5)]
    assert passed(slow, JointOrder(10 * S))[1] == slow


@given(st.lists(st.integers(0, 2**62), max_size=60))
def test_whatever_comes_is_passed_on_or_rejected_once(times_ns):
    order, sure = passed(times_ns)
    order.restart()
    assert len(sure) + order.rejected == len(times_ns)
    falls = sum(b < a for a, b in pairwise(sure))
    assert falls <= len(times_ns) // LEAST_TO_JUMP
