"""Sends transforms."""

from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from underlay_refusal import Partial


class TransformBroadcaster(Partial):
    """Publishes transforms on /tf."""

    def __init__(self, node):
        self.pub_tf = node.create_publisher(TFMessage, '/tf', QoSProfile(depth=100))

    def sendTransform(self, transform):  # noqa: N802
        """Publish a transform."""
        self.pub_tf.publish(TFMessage(transforms=[transform]))
