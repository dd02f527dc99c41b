"""Messages as they are in bags, without ROS."""

from typing import Any

from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES: dict[str, Any] = dict(STORE.types)
SCAN, JOINT_STATE = 'sensor_msgs/msg/LaserScan', 'sensor_msgs/msg/JointState'
TF = 'tf2_msgs/msg/TFMessage'


def header(stamp_ns: int, frame_id: str) -> Any:
    """Return a header with a stamp [ns]."""
    seconds, nanoseconds = divmod(stamp_ns, NS_PER_S)
    time = TYPES['builtin_interfaces/msg/Time'](seconds, nanoseconds)
    return TYPES['std_msgs/msg/Header'](time, frame_id)


def transforms(stamp_ns: int, parent: str, child: str, pose: Pose) -> Any:
    """Return the message for TF of one frame's pose in another, with a stamp [ns]."""
    transform = TYPES['geometry_msgs/msg/Transform'](
        TYPES['geometry_msgs/msg/Vector3'](*pose.position.tolist()),
        TYPES['geometry_msgs/msg/Quaternion'](*pose.quaternion),
    )
    stamped = TYPES['geometry_msgs/msg/TransformStamped'](
        header(stamp_ns, parent), child, transform
    )
    return TYPES[TF]([stamped])
