"""The topics of bags, and the error of their readers and writers."""

from dataclasses import dataclass

from nodlidar_common.bag_messages import JOINT_STATE, SCAN, TF
from nodlidar_common.errors import NodlidarError


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
