"""Sends transforms that hold at all times."""

from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from underlay_refusal import Partial


class StaticTransformBroadcaster(Partial):
    """Publishes all transforms that it has sent so far on /tf_static, also to late listeners.

    As on Jazzy, the first transform of a child frame stays.
    """

    def __init__(self, node):
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pub_tf = node.create_publisher(TFMessage, '/tf_static', qos)
        self.net_message = TFMessage()

    def sendTransform(self, transform):  # noqa: N802
        """Publish a transform together with the earlier ones."""
        known = {earlier.child_frame_id for earlier in self.net_message.transforms}
        if transform.child_frame_id not in known:
            self.net_message.transforms.append(transform)
        self.pub_tf.publish(self.net_message)
