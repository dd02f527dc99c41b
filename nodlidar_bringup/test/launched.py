"""A launched sensor and an observer of its topics, for tests that run the whole system."""

from collections import defaultdict
from contextlib import contextmanager
import os
import signal
import subprocess
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
import tf2_ros

START_TIMEOUT = 40.0
STOP_TIMEOUT = 20.0


class Sensor:
    """A running `ros2 launch nodlidar_bringup robot.launch.py`."""

    def __init__(self, log, *arguments):
        self.log = log
        command = ['ros2', 'launch', 'nodlidar_bringup', 'robot.launch.py', *arguments]
        with log.open('wb') as output:
            self.process = subprocess.Popen(
                command, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )

    def running(self):
        return self.process.poll() is None

    def interrupt(self):
        """End it as Ctrl-C would; return its exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(STOP_TIMEOUT)

    def kill(self):
        if self.running():
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


@contextmanager
def sensor(log, *arguments):
    """Run the launch file; whatever a test leaves of it is killed."""
    running = Sensor(log, *arguments)
    try:
        yield running
    finally:
        running.kill()


class Observer:
    """Collects the messages of topics and the transforms."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node('observer', context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self.messages = defaultdict(list)
        self.transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self.transforms, self.node, spin_thread=False)

    def subscribe(self, message_type, topic, qos=50):
        self.node.create_subscription(message_type, topic, self.messages[topic].append, qos)

    def spin_until(self, condition, what, timeout=START_TIMEOUT):
        """Spin until a condition holds; fail with what was waited for when it does not."""
        deadline = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < deadline, f'waited {timeout} s for {what}'
            self._executor.spin_once(timeout_sec=0.1)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)
