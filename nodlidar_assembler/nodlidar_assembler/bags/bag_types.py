"""Message types and the error of the readers and writers of bags."""

from dataclasses import dataclass

from nodlidar_common.errors import NodlidarError
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
SCAN, JOINT_STATE = 'sensor_msgs/msg/LaserScan', 'sensor_msgs/msg/JointState'
TF = 'tf2_msgs/msg/TFMessage'


@dataclass(frozen=True, slots=True)
class Topics:
    """Input topics in a bag; fixed transforms are on `tf` + '_static'."""

    scan: str = '/scan'
    joint_states: str = '/joint_states'
    tf: str = '/tf'


ANY = Topics('', '', '')  # those that the bag has


class BagError(NodlidarError):
    """A bag that cannot be read, or lacks required content."""
