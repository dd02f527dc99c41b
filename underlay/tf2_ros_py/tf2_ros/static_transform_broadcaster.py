"""Sends transforms that hold at all times."""

from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from tf2_ros.transform_broadcaster import as_list


class StaticTransformBroadcaster:
    """Publishes all transforms that it was ever given on /tf_static, also to late listeners.

    As on Jazzy, the first transform given for a child frame stays.
    """

    def __init__(self, node, qos=None):
        if qos is None:
            qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pub_tf = node.create_publisher(TFMessage, '/tf_static', qos)
        self.net_message = TFMessage()

    def sendTransform(self, transform):  # noqa: N802
        """Publish a transform or several, together with the earlier ones."""
        known = {given.child_frame_id for given in self.net_message.transforms}
        for given in as_list(transform):
            if given.child_frame_id not in known:
                known.add(given.child_frame_id)
                self.net_message.transforms.append(given)
        self.pub_tf.publish(self.net_message)
