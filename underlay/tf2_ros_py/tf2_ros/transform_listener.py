"""Fills a buffer with the transforms of /tf and /tf_static."""

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from underlay_refusal import Partial, refuse_arguments


class TransformListener(Partial):
    """Puts the transforms of /tf and /tf_static into a buffer."""

    def __init__(self, buffer, node, **uncovered):
        refuse_arguments('TransformListener', uncovered)
        self.buffer = buffer
        self.node = node
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        # Reentrant as on Jazzy: both callbacks may run at the same time.
        group = ReentrantCallbackGroup()
        self.tf_sub = node.create_subscription(
            TFMessage, '/tf', self.callback, QoSProfile(depth=100), callback_group=group
        )
        self.tf_static_sub = node.create_subscription(
            TFMessage, '/tf_static', self.static_callback, latched, callback_group=group
        )

    def unregister(self):
        """Stop listening."""
        self.node.destroy_subscription(self.tf_sub)
        self.node.destroy_subscription(self.tf_static_sub)

    def callback(self, data):
        """Put the transforms of a message into the buffer."""
        for transform in data.transforms:
            self.buffer.set_transform(transform, 'default_authority')

    def static_callback(self, data):
        """Put the transforms of a message into the buffer, to hold at all times."""
        for transform in data.transforms:
            self.buffer.set_transform_static(transform, 'default_authority')
