"""Passes on what joint states tell of the nod's joint."""

from collections import Counter

from message_filters import SimpleFilter
from nodlidar_assembler.clouds.pitch import LARGEST
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import JointState


class JointFilter(SimpleFilter):
    """Joint states in, (instant [ns], pitch [rad]) of one joint out; counts the malformed ones.

    Messages without that joint are other joints' (a robot has many on one topic) and not counted.

    Parameters
    ----------
    source
        Of the joint states.
    config
        Names the joint, and tells how its positions and stamps are to be taken.
    drops
        Where malformed ones are counted.
    """

    MALFORMED = f'joint state without a position up to {LARGEST:g} rad, or stamped before 1970'

    def __init__(self, source: SimpleFilter, config: AssemblerConfig, drops: Counter[str]) -> None:
        super().__init__()
        self._joint_name, self._zero = config.joint_name, config.joint_zero
        self._sign = 1.0 if config.joint_positive == 'up' else -1.0
        self._delay_ns = round(config.joint_delay * NS_PER_S)
        self._drops = drops
        self._heard = False
        self._others: set[str] = set()
        source.registerCallback(self._add)

    @property
    def trouble(self) -> str:
        """Why no joint state told of the joint, in words; empty if one did."""
        if self._heard:
            return ''
        if not self._others:
            return 'no joint state was heard'
        others = ', '.join(f"'{name}'" for name in sorted(self._others))
        return f"no joint state tells of '{self._joint_name}', but of {others}"

    def _add(self, message: JointState) -> None:
        if self._joint_name not in message.name:
            self._others.update(message.name)
            return
        self._heard = True
        index = message.name.index(self._joint_name)
        told = index < len(message.position) and abs(message.position[index]) <= LARGEST
        measured_ns = time_ns(message.header.stamp) - self._delay_ns
        if told and measured_ns >= 0:  # no time before 1970 can be published
            pitch = self._sign * (float(message.position[index]) - self._zero)
            self.signalMessage(measured_ns, pitch)
        else:
            self._drops[self.MALFORMED] += 1
