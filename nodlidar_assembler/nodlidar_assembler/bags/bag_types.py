"""Message types and the error of the readers and writers of bags."""

from dataclasses import dataclass

from nodlidar_common.errors import NodlidarError
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
SCAN, JOINT_STATE = 'sensor_msgs/msg/LaserScan', 'sensor_msgs/msg/JointState'
TF = 'tf2_msgs/msg/TFMessage'


@dataclass(frozen=True, slots=True)
class Topics:
    """Input topics in a bag; where empty, the usual one, or the only one of its type."""

    scan: str = ''
    joint_states: str = ''
    tf: str = ''


# The usual topic of each type, and the option that names another one.
USUAL = {
    SCAN: ('/scan', '--scan'),
    JOINT_STATE: ('/joint_states', '--joint-states'),
    TF: ('/tf', '--tf'),
}
STATIC = '_static'  # behind the topic of moving transforms: that of the fixed ones


class BagError(NodlidarError):
    """A bag that cannot be read, or lacks required content."""
