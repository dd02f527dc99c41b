"""Fills a buffer with what is heard."""

from contextlib import suppress
from threading import Thread

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage


class TransformListener:
    """Puts the transforms of /tf and /tf_static into a buffer.

    With `spin_thread`, a thread of its own spins the node, which nobody else may do then; it
    ends when rclpy is shut down.
    """

    def __init__(self, buffer, node, *, spin_thread=False, qos=None, static_qos=None):
        if qos is None:
            qos = QoSProfile(depth=100)
        if static_qos is None:
            static_qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.buffer = buffer
        self.node = node
        # Reentrant, so that a callback of the node's own group may wait for a transform.
        self.group = ReentrantCallbackGroup()
        self.tf_sub = node.create_subscription(
            TFMessage, '/tf', self.callback, qos, callback_group=self.group
        )
        self.tf_static_sub = node.create_subscription(
            TFMessage, '/tf_static', self.static_callback, static_qos, callback_group=self.group
        )
        if spin_thread:
            self.executor = SingleThreadedExecutor()
            self.executor.add_node(node)
            self.dedicated_listener_thread = Thread(
                target=_spin, args=[self.executor], name='tf2_ros', daemon=True
            )
            self.dedicated_listener_thread.start()

    def unregister(self):
        """Stop listening."""
        self.node.destroy_subscription(self.tf_sub)
        self.node.destroy_subscription(self.tf_static_sub)

    def callback(self, data):
        """Take the transforms of a message."""
        for transform in data.transforms:
            self.buffer.set_transform(transform, 'default_authority')

    def static_callback(self, data):
        """Take the transforms of a message, which hold at all times."""
        for transform in data.transforms:
            self.buffer.set_transform_static(transform, 'default_authority')


def _spin(executor):
    with suppress(ExternalShutdownException):
        executor.spin()
