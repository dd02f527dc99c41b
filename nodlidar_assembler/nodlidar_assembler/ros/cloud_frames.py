"""The frames of clouds in odometry, published to TF when they are first used."""

from geometry_msgs.msg import TransformStamped
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.origins import frame_of, OF_ODOMETRY
from nodlidar_common.ros.messages import time_message
from rclpy.node import Node
from tf2_ros import StaticTransformBroadcaster


class CloudFrames:
    """Names the frame of each cloud, and publishes its place in the frame of odometry.

    Parameters
    ----------
    node
        Publishes on /tf_static.
    odom_frame
        Frame of odometry.
    """

    def __init__(self, node: Node, odom_frame: str) -> None:
        self._odom_frame = odom_frame
        self._known = {OF_ODOMETRY}
        self._broadcaster = StaticTransformBroadcaster(node)

    def frame(self, cloud: Points) -> str:
        """Return the frame of a cloud's coordinates; publish it to TF if it is new."""
        frame = frame_of(cloud.origin, self._odom_frame)
        if cloud.origin not in self._known:
            self._known.add(cloud.origin)
            self._broadcaster.sendTransform(self._transform(cloud, frame))
        return frame

    def _transform(self, cloud: Points, frame: str) -> TransformStamped:
        transform = TransformStamped(child_frame_id=frame)
        transform.header.frame_id = self._odom_frame
        transform.header.stamp = time_message(int(cloud.time_ns[0]))
        shift = transform.transform.translation
        shift.x, shift.y, shift.z = map(float, cloud.origin)
        return transform
