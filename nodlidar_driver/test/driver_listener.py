"""The node of a driver, and a node that hears what it publishes."""

from contextlib import contextmanager
import re
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodlidar_common.ros.executor import Executor
from nodlidar_driver.ros.scip_node import ScipNode
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import LaserScan, TimeReference

TIMEOUT = 20.0
SUCCESS = TransitionCallbackReturn.SUCCESS


def options(parameters, namespace=''):
    words = [word for key, value in parameters.items() for word in ('-p', f'{key}:={value}')]
    return ['--ros-args', '-r', f'__ns:=/{namespace}', *words]


class Listener:
    """The node of a driver in this process, and everything that it publishes."""

    def __init__(self, make_node, parameters):
        rclpy.init(args=options(parameters))
        self.scans, self.arrivals, self.status = [], [], None
        self.driver = make_node()
        self.node = rclpy.create_node('listener')
        self.node.create_subscription(LaserScan, 'scan', self.scans.append, 10)
        self.node.create_subscription(TimeReference, 'driver/arrival', self.arrivals.append, 10)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, 10)
        self._executor = Executor()
        self._executor.add_node(self.driver)
        self._executor.add_node(self.node)

    def _diagnosed(self, message):
        self.status = message.status[0]

    def activate(self):
        assert self.driver.trigger_configure() == SUCCESS
        assert self.driver.trigger_activate() == SUCCESS

    def until(self, condition, what):
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < deadline, f'no {what}; last status: {self.status}'
            self._executor.spin_once(timeout_sec=0.05)

    def receive(self, count):
        self.scans.clear()
        self.until(lambda: len(self.scans) >= count, f'{count} scans')
        return list(self.scans)

    def diagnosed(self, level, text):
        self.until(
            lambda: self.status and self.status.level == level and text in self.status.message,
            f'diagnosis {text!r}',
        )
        return {item.key: item.value for item in self.status.values}

    def connected(self):
        # A busy host makes scans late, which is a warning.
        said = {
            DiagnosticStatus.OK: r'connected',
            DiagnosticStatus.WARN: r'scans came up to [\d.]+ s late; their stamps are right',
        }
        self.until(
            lambda: (
                self.status
                and self.status.level in said
                and re.fullmatch(said[self.status.level], self.status.message)
            ),
            'report of a connection',
        )
        return {item.key: item.value for item in self.status.values}

    def close(self):
        self._executor.shutdown()
        self.driver.destroy_node()
        self.node.destroy_node()
        rclpy.shutdown()


@contextmanager
def listening(make_node=ScipNode, **parameters):
    listener = Listener(make_node, {'reconnect_delay': 0.2} | parameters)
    try:
        yield listener
    finally:
        listener.close()
