"""Passes on what joint states tell of the nod's joint."""

from collections import Counter

from message_filters import SimpleFilter
from nodlidar_assembler.pitch import LARGEST
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import JointState


class JointFilter(SimpleFilter):
    """Joint states in, (stamp [ns], position [rad]) of one joint out; counts the malformed ones.

    Messages without that joint are other joints' (a robot has many on one topic) and not counted.
    """

    MALFORMED = f'joint state without a position up to {LARGEST:g} rad, or stamped before 1970'

    def __init__(self, source: SimpleFilter, joint_name: str, drops: Counter[str]) -> None:
        super().__init__()
        self._joint_name = joint_name
        self._drops = drops
        source.registerCallback(self._add)

    def _add(self, message: JointState) -> None:
        if self._joint_name not in message.name:
            return
        index = message.name.index(self._joint_name)
        told = index < len(message.position) and abs(message.position[index]) <= LARGEST
        if told and message.header.stamp.sec >= 0:  # no time before it can be published
            self.signalMessage(time_ns(message.header.stamp), float(message.position[index]))
        else:
            self._drops[self.MALFORMED] += 1
