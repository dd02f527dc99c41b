"""Subscriptions that wake the node only when their messages are wanted, on real DDS."""

from builtin_interfaces.msg import Time
from nodlidar_common.ros.polled import PolledSubscription, taken, WhenWanted
import pytest
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

SENT = 30


class Listener(Node):
    """A node whose messages wait until `wanted` is set; notes what wakes it."""

    def __init__(self):
        super().__init__('listener')
        self.wanted, self.woke = False, []
        self.sub = self.create_subscription(
            Time,
            'numbers',
            lambda message: self.woke.append(message.sec),
            QoSProfile(depth=SENT),
            callback_group=WhenWanted(lambda: self.wanted),
        )


@pytest.fixture
def listening():
    """Return a node to which numbers are sent, its executor and the function that sends one."""
    rclpy.init()
    listener, talker = Listener(), Node('talker')
    numbers = talker.create_publisher(Time, 'numbers', QoSProfile(depth=SENT))
    executor = SingleThreadedExecutor()
    executor.add_node(listener)

    def spin_until(is_over):
        for _ in range(500):
            executor.spin_once(timeout_sec=0.01)
            if is_over():
                return
        pytest.fail('nothing came')

    spin_until(lambda: numbers.get_subscription_count())
    yield listener, spin_until, lambda number: numbers.publish(Time(sec=number))
    executor.shutdown()
    listener.destroy_node()
    talker.destroy_node()
    rclpy.shutdown()


def test_messages_wait_until_they_are_taken_and_wake_nobody(listening):
    listener, spin_until, send = listening
    for number in range(SENT):
        send(number)
    got = []

    def take():
        got.extend((message.sec, info) for message, info in taken(listener.sub))
        return len(got) == SENT

    spin_until(take)
    assert [number for number, _ in got] == list(range(SENT))
    numbers = [info['publication_sequence_number'] for _, info in got]
    assert [number - numbers[0] for number in numbers] == list(range(SENT))
    assert listener.woke == []


def test_a_wanted_message_wakes_the_node_also_if_it_came_before(listening):
    listener, spin_until, send = listening
    send(1)
    spin_until(lambda: True)
    assert listener.woke == []
    listener.wanted = True
    spin_until(lambda: listener.woke == [1])
    send(2)
    spin_until(lambda: listener.woke == [1, 2])
    listener.wanted = False
    send(3)
    spin_until(lambda: True)
    assert listener.woke == [1, 2]
    assert [message.sec for message, _ in taken(listener.sub)] in ([], [3])  # on the way or there


def test_publishers_that_a_waiting_subscription_cannot_hear_are_reported(listening):
    listener, spin_until, _ = listening
    reports = []
    listener.create_subscription(
        Time,
        'more',
        lambda message: None,
        QoSProfile(depth=1),
        callback_group=WhenWanted(),
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=reports.append),
    )
    unreliable = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    listener.create_publisher(Time, 'more', unreliable)
    spin_until(lambda: reports)
    assert reports[0].total_count == 1


def test_the_qos_of_a_topic_is_overridden_each_time_and_no_other_s():
    override = 'qos_overrides./numbers.subscription.reliability:=best_effort'
    rclpy.init(args=['--ros-args', '-p', override])
    node, profile = Node('viewer'), QoSProfile(depth=1)
    for _ in range(2):
        polled = [PolledSubscription(node, Time, topic, profile) for topic in ('numbers', 'more')]
        for topic, expected in (('/numbers', 'BEST_EFFORT'), ('/more', 'RELIABLE')):
            (found,) = node.get_subscriptions_info_by_topic(topic)
            assert found.qos_profile.reliability == ReliabilityPolicy[expected]
        for each in polled:
            each.end()
    node.destroy_node()
    rclpy.shutdown()
