"""The frames of clouds in odometry, published to TF when they are first used."""

from nodlidar_assembler.clouds.origins import frame_of, OF_ODOMETRY
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import transform_message
import numpy as np
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
            place = Pose(np.array(cloud.origin, dtype=np.float64), np.eye(3))
            stamp_ns = int(cloud.time_ns[0])
            self._broadcaster.sendTransform(
                transform_message(stamp_ns, self._odom_frame, frame, place)
            )
        return frame
