"""A node's diagnostics where its own clock stands still, and in a namespace."""

from contextlib import contextmanager
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodlidar_common.ros.diagnostics import SteadyUpdater
from nodlidar_common.ros.steady import create_steady_timer
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

LONGEST = 30.0


class Bench:
    """A node whose clock stands still (simulated time that nobody tells), and its diagnostics."""

    def __init__(self, namespace):
        rclpy.init(args=['--ros-args', '-p', 'use_sim_time:=true'])
        self.node = Node('device', namespace=namespace)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.state, self.told = 'well', []
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 50)
        self.updater = SteadyUpdater(self.node, 'port 7', lambda: self.state)
        self.updater.add('health', self._report)

    def _report(self, status):
        status.summary(DiagnosticStatus.OK, self.state)
        return status

    def _hear(self, array):
        self.told += [(time.monotonic(), status) for status in array.status]

    def until(self, message, count=1):
        """Spin until a message was told so often; return when, and the last status."""
        deadline = time.monotonic() + LONGEST
        while sum(status.message == message for _, status in self.told) < count:
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.05)
        return self.told[-1]


@contextmanager
def bench(namespace=''):
    made = Bench(namespace)
    try:
        yield made
    finally:
        made.executor.shutdown()
        made.node.destroy_node()
        rclpy.shutdown()


def test_diagnostics_come_once_a_second_while_the_node_s_clock_stands_still():
    with bench() as running:
        first, _ = running.until('well')
        second, _ = running.until('well', 2)
    assert 0.8 < second - first < 2.0


def test_another_state_is_told_at_once():
    with bench() as running:
        running.until('well')
        running.state = 'ill'
        changed = time.monotonic()
        told, _ = running.until('ill')
    assert told - changed < 0.7


@pytest.mark.parametrize(
    ('namespace', 'name'), [('', 'device: health'), ('left', 'left/device: health')]
)
def test_statuses_are_named_after_the_whole_name_of_the_node(namespace, name):
    with bench(namespace) as running:
        _, status = running.until('well')
    assert (status.name, status.hardware_id) == (name, 'port 7')


def test_a_steady_timer_goes_on_while_the_node_s_clock_stands_still():
    with bench() as running:
        calls = []
        create_steady_timer(running.node, 0.01, lambda: calls.append(time.monotonic()))
        deadline = time.monotonic() + LONGEST
        while len(calls) < 3:
            assert time.monotonic() < deadline
            running.executor.spin_once(timeout_sec=0.05)
