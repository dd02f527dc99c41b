from message_filters import (
    ApproximateTimeSynchronizer,
    Cache,
    SimpleFilter,
    Subscriber,
    TimeSynchronizer,
)
import pytest
import rclpy
from rclpy.clock import ClockType
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from std_msgs.msg import Header, String


class Stamped:
    def __init__(self, nanoseconds):
        self.header = Header(stamp=at(nanoseconds).to_msg())

    def __repr__(self):
        return f'Stamped({Time.from_msg(self.header.stamp).nanoseconds})'


def at(nanoseconds):
    return Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)


def feed(inputs, *arrivals):
    """Signal (input, nanoseconds) pairs; return the messages."""
    messages = [(index, Stamped(nanoseconds)) for index, nanoseconds in arrivals]
    for index, message in messages:
        inputs[index].signalMessage(message)
    return [message for _, message in messages]


def collect(source):
    collected = []
    source.registerCallback(lambda *messages: collected.append(messages))
    return collected


def test_callbacks_get_the_output_and_their_own_arguments():
    calls = []
    source = SimpleFilter()
    assert source.registerCallback(lambda *args: calls.append(args), 'a', 1) == 0
    assert source.registerCallback(lambda *args: calls.append(args)) == 1
    source.signalMessage('x', 'y')
    assert calls == [('x', 'y', 'a', 1), ('x', 'y')]


class TestCache:
    @pytest.fixture
    def cached(self):
        source = SimpleFilter()
        cache = Cache(source, 4)
        # The first is forgotten; 30 arrives before 20, and 20 twice.
        return cache, feed([source], *[(0, t) for t in (5, 10, 30, 20, 20)])[1:]

    def test_order_of_arrival_and_size(self, cached):
        cache, messages = cached
        assert cache.cache_msgs == messages
        assert (cache.getOldestTime(), cache.getLastestTime()) == (at(10), at(20))

    def test_interval_includes_both_ends(self, cached):
        cache, (m10, m30, m20, m20_again) = cached
        assert cache.getInterval(at(10), at(20)) == [m10, m20, m20_again]
        assert cache.getInterval(at(20), at(30)) == [m30, m20, m20_again]
        assert cache.getInterval(at(11), at(19)) == []
        with pytest.raises(AssertionError):
            cache.getInterval(at(2), at(1))

    def test_neighbours(self, cached):
        cache, (m10, m30, m20, m20_again) = cached
        assert cache.getElemBeforeTime(at(20)) is m20_again
        assert cache.getElemBeforeTime(at(19)) is m10
        assert cache.getElemBeforeTime(at(9)) is None
        assert cache.getElemAfterTime(at(20)) is m30  # the first to have arrived
        assert cache.getElemAfterTime(at(31)) is None
        assert cache.getLast() is m30
        assert m20 in cache.cache_msgs

    def test_empty(self):
        cache = Cache(SimpleFilter())
        assert (cache.getLastestTime(), cache.getOldestTime(), cache.getLast()) == (None,) * 3

    def test_headerless_messages(self):
        strict, lenient = SimpleFilter(), SimpleFilter()
        refused, taken = Cache(strict, 2), Cache(lenient, 2, allow_headerless=True)
        strict.signalMessage(String())
        lenient.signalMessage(String())
        assert refused.cache_msgs == []
        assert taken.getLastestTime() > at(0)


class TestTimeSynchronizer:
    def test_sets_come_out_in_the_order_of_their_completion(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(TimeSynchronizer(inputs, 3))
        a1, a2, _, b2, b1 = feed(inputs, (0, 1), (0, 2), (1, 3), (1, 2), (1, 1))
        assert sets == [(a2, b2), (a1, b1)]

    def test_full_queue_forgets_the_oldest_stamp(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(TimeSynchronizer(inputs, 2))
        _, a2, _, _, b2 = feed(inputs, (0, 1), (0, 2), (0, 3), (1, 1), (1, 2))
        assert sets == [(a2, b2)]

    def test_equal_stamp_replaces(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(TimeSynchronizer(inputs, 2))
        _, again, b = feed(inputs, (0, 1), (0, 1), (1, 1))
        assert sets == [(again, b)]

    def test_failing_callback_leaves_it_usable(self):
        inputs = [SimpleFilter()]
        synchronizer = TimeSynchronizer(inputs, 1)
        synchronizer.registerCallback(lambda message: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            feed(inputs, (0, 1))
        with pytest.raises(ZeroDivisionError):
            feed(inputs, (0, 2))


class TestApproximateTimeSynchronizer:
    def test_span_must_be_less_than_slop(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(ApproximateTimeSynchronizer(inputs, 5, 10e-9))
        feed(inputs, (0, 0), (1, 10))
        assert sets == []
        near = feed(inputs, (0, 1))
        assert [a for a, _ in sets] == near

    def test_nearest_waiting_message_is_taken(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(ApproximateTimeSynchronizer(inputs, 5, 10e-9))
        _, a7, _, b = feed(inputs, (0, 0), (0, 7), (0, 11), (1, 8))
        assert sets == [(a7, b)]

    def test_first_complete_set_does_not_wait_for_a_nearer_one(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(ApproximateTimeSynchronizer(inputs, 5, 10e-9))
        a, early, _ = feed(inputs, (0, 100), (1, 92), (1, 100))
        assert sets == [(a, early)]

    def test_next_best_of_a_later_input_is_tried_first(self):
        inputs = [SimpleFilter(), SimpleFilter(), SimpleFilter()]
        sets = collect(ApproximateTimeSynchronizer(inputs, 5, 10e-9))
        # From c = 100, b = 95 and a = 106 are nearest but span 11: a = 94 is tried next.
        a94, a106, b93, b95, c = feed(inputs, (0, 94), (0, 106), (1, 93), (1, 95), (2, 100))
        assert sets == [(a94, b95, c)]
        assert (a106, b93) not in sets

    def test_late_message_outside_a_full_queue_is_not_matched(self):
        inputs = [SimpleFilter(), SimpleFilter()]
        sets = collect(ApproximateTimeSynchronizer(inputs, 1, 10e-9))
        feed(inputs, (0, 20), (1, 1), (0, 2))
        assert sets == []

    def test_headerless_messages(self):
        strict, lenient = SimpleFilter(), SimpleFilter()
        refused = collect(ApproximateTimeSynchronizer([strict], 2, 0.1))
        taken = collect(ApproximateTimeSynchronizer([lenient], 2, 0.1, allow_headerless=True))
        strict.signalMessage(String())
        lenient.signalMessage(String())
        assert (len(refused), len(taken)) == (0, 1)


@pytest.fixture
def node():
    rclpy.init()
    node = rclpy.create_node('test_message_filters')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_subscriber_passes_on_what_it_receives(node):
    source = Subscriber(node, Header, 'stamps', qos_profile=qos_profile_sensor_data)
    cache = Cache(source, 10)
    publisher = node.create_publisher(Header, 'stamps', 10)
    assert source.getTopic() == 'stamps'
    assert source.topic_name == '/stamps'  # an attribute of the subscription
    received = collect(source)
    while not received:
        publisher.publish(Header(frame_id='x'))
        rclpy.spin_once(node, timeout_sec=0.05)
    assert received[0][0].frame_id == 'x'
    assert cache.cache_msgs == []  # a bare Header has no header of its own
