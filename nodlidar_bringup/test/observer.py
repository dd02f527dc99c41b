"""An observer of a launched sensor, for tests that run the whole system."""

from collections import defaultdict
import time

from nodlidar_common.ros.executor import Executor
import rclpy
from rclpy.node import Node
import tf2_ros

START_TIMEOUT = 40.0


class Observer:
    """Collects the messages of topics and the transforms."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node('observer', context=self.context)
        self._executor = Executor(context=self.context)
        self._executor.add_node(self.node)
        self.messages = defaultdict(list)
        self.transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self.transforms, self.node)

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
