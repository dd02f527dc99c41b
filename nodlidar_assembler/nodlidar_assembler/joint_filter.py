"""Passes on the joint states that tell the position of the nod's joint."""

from collections import Counter
import math

from message_filters import SimpleFilter
from sensor_msgs.msg import JointState


class JointFilter(SimpleFilter):
    """Passes joint states that tell one joint's position and when, and counts the malformed ones.

    Messages without that joint are other joints' (a robot has many on one topic) and not counted.
    """

    MALFORMED = 'joint state without a finite position or with a stamp before 1970'

    def __init__(self, source: SimpleFilter, joint_name: str, drops: Counter[str]) -> None:
        super().__init__()
        self._joint_name = joint_name
        self._drops = drops
        source.registerCallback(self._add)

    def position(self, message: JointState) -> float:
        """Return the joint's position [rad] in a message that this filter passed on."""
        return float(message.position[message.name.index(self._joint_name)])

    def _add(self, message: JointState) -> None:
        if self._joint_name not in message.name:
            return
        if self._is_well_formed(message):
            self.signalMessage(message)
        else:
            self._drops[self.MALFORMED] += 1

    def _is_well_formed(self, message: JointState) -> bool:
        index = message.name.index(self._joint_name)
        told = index < len(message.position) and math.isfinite(message.position[index])
        return told and message.header.stamp.sec >= 0  # what rclpy's Time cannot hold
