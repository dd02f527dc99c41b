"""The executor of the nodes: what wakes it, and how often."""

import time

from nodlidar_common.ros import executor as module
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.polled import taken, WhenWanted
import pytest
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Empty, UInt8

BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)


@pytest.fixture
def node():
    rclpy.init()
    node = rclpy.create_node('looking')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def spin_until(executor, condition, timeout=5.0):
    end = time.monotonic() + timeout
    while not condition() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)
    return condition()


def test_publishers_of_another_quality_are_reported(node):
    reports = []
    events = SubscriptionEventCallbacks(incompatible_qos=reports.append)
    executor = Executor()
    executor.add_node(node)
    spin_until(executor, lambda: False, 0.2)
    node.create_subscription(Empty, 'topic', lambda _: None, RELIABLE, event_callbacks=events)
    node.create_publisher(Empty, 'topic', BEST_EFFORT)
    assert spin_until(executor, lambda: bool(reports))
    assert reports[0].total_count == 1
    executor.shutdown()


def test_between_two_looks_events_do_not_wake_the_node(node, monkeypatch):
    now = [0]
    monkeypatch.setattr(module, 'steady_ns', lambda: now[0])
    node.create_subscription(Empty, 'topic', lambda _: None, RELIABLE)
    executor = Executor()
    executor.add_node(node)
    looks = []
    for now[0] in range(0, 3_000_000_000, 250_000_000):
        executor.spin_once(timeout_sec=0.0)
        looks.append({executor.can_execute(event) for event in node.waitables})
        assert all(executor.can_execute(timed) for timed in node.subscriptions)
    assert looks == [{True}, {False}, {False}, {False}] * 3
    executor.shutdown()


def test_messages_that_wait_do_not_keep_the_node_awake(node, monkeypatch):
    waiting = node.create_subscription(
        UInt8, 'numbers', lambda _: None, QoSProfile(depth=10), callback_group=WhenWanted()
    )
    publisher = node.create_publisher(UInt8, 'numbers', QoSProfile(depth=10))
    executor = Executor()
    executor.add_node(node)
    received = []

    def heard():
        publisher.publish(UInt8())
        received.extend(taken(waiting))
        return received

    assert spin_until(executor, heard)
    publisher.publish(UInt8())
    asked, able = [], executor.can_execute
    monkeypatch.setattr(executor, 'can_execute', lambda each: asked.append(each) or able(each))
    spins = 0
    end = time.monotonic() + 2.5
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.5)
        spins += 1
    assert spins < 10
    assert asked.count(waiting) <= 2 * spins
    executor.shutdown()


def test_the_end_of_a_callback_does_not_wake_the_node(node, monkeypatch):
    executor, ran = Executor(), []
    executor.add_node(node)
    timer = node.create_timer(0.01, lambda: (ran.append(True), timer.cancel()))
    assert spin_until(executor, lambda: bool(ran))
    asked, able = [], executor.can_execute
    monkeypatch.setattr(executor, 'can_execute', lambda each: asked.append(each) or able(each))
    executor.spin_once(timeout_sec=0.05)
    assert asked.count(timer) == 1
    executor.shutdown()
