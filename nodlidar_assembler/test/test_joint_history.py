"""The history of joint samples, against a plain list of them."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.joint_history import JointHistory, SPAN_NS

instants = st.integers(0, 20)


def history_of(times):
    history = JointHistory()
    for k, time_ns in enumerate(times):
        history.add(time_ns, float(k))
    return history


@given(st.lists(instants), instants, instants)
def test_samples_are_found_by_time_in_whatever_order_they_came(times, one, other):
    history, (begin, end) = history_of(times), sorted([one, other])
    assert history.before(begin) == max((t for t in times if t <= begin), default=None)
    assert history.after(begin) == min((t for t in times if t >= begin), default=None)
    assert history.newest_ns == max(times, default=None)
    inside = [(t, float(k)) for k, t in enumerate(times) if begin <= t <= end]
    found = history.between(begin, end)
    assert list(zip(*found, strict=True)) == sorted(inside, key=lambda sample: sample[0])


def test_what_is_older_than_its_span_is_forgotten():
    history = history_of([0, 1, SPAN_NS, SPAN_NS + 1])
    assert history.between(0, 2 * SPAN_NS).time_ns.tolist() == [1, SPAN_NS, SPAN_NS + 1]


def test_a_history_that_was_cleared_has_nothing():
    history = history_of([1, 2])
    history.clear()
    assert (history.newest_ns, history.before(5), history.after(0)) == (None, None, None)
    assert [len(column) for column in history.between(0, 5)] == [0, 0]
