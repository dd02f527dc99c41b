"""JointState messages as samples of the nod's joint."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

from nodlidar_assembler.clouds.joint_order import JointOrder, JointSamplesConfig
from nodlidar_assembler.clouds.pitch import LARGEST
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import LATEST_NS, time_ns

# Names of other joints that are told where the nod's is missing.
_MOST_OTHERS = 20


@dataclass(frozen=True)
class JointInputConfig(JointSamplesConfig):
    """Joint state messages."""

    joint_name: str = parameter('nod_joint', 'Joint whose position is the pitch of the scan plane')
    joint_positive: str = parameter(
        'up',
        'Direction in which the beams turn as the joint position rises: up (axis 0 -1 0, as in '
        'nodlidar_bringup) or down (axis 0 1 0, as on many tilting lidars)',
        choices=('up', 'down'),
    )
    joint_zero: float = parameter(
        0.0,
        'Joint position at pitch 0',
        unit='rad',
        minimum=-10.0,
        maximum=10.0,
    )
    joint_delay: float = parameter(
        0.0,
        'Delay of joint state stamps after the measurement',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )


class JointInput:
    """Finds the samples of one joint in joint states, and counts the malformed ones.

    Messages without that joint are other joints' (a robot has many on one topic) and not counted.
    Samples leave in the order of their time, but for the first after time went back.

    Parameters
    ----------
    config
        Names the joint, and tells how its positions and stamps are to be taken.
    drops
        Where malformed ones are counted.
    """

    MALFORMED = f'joint state without a position up to {LARGEST:g} rad, or not of 1970 to 2038'
    OUT_OF_ORDER = 'joint state of another time than those around it'

    def __init__(self, config: JointInputConfig, drops: Counter[str]) -> None:
        self._joint_name, self._zero = config.joint_name, config.joint_zero
        self._sign = 1.0 if config.joint_positive == 'up' else -1.0
        self._delay_ns = round(config.joint_delay * NS_PER_S)
        self._drops = drops
        self._order = JointOrder(round(config.max_joint_gap * NS_PER_S))
        self._heard = False
        self._others: set[str] = set()

    @property
    def trouble(self) -> str:
        """Why no joint state told of the joint, in words; empty if one did."""
        if self._heard:
            return ''
        if not self._others:
            return 'no joint state was heard'
        others = ', '.join(f"'{name}'" for name in sorted(self._others))
        return f"no joint state tells of '{self._joint_name}', but of {others}"

    def restart(self) -> None:
        """Begin anew with whatever comes next: the clock was set."""
        self._order.restart()
        self._count_left_out()

    def tells_of_joint(self, message: Any) -> bool:
        """Tell whether a message is about the nod's joint."""
        return self._joint_name in message.name

    def samples(self, message: Any) -> list[tuple[int, float]]:
        """Take a joint state; return the samples [ns], [rad] that are sure by now."""
        if not self.tells_of_joint(message):
            if len(self._others) < _MOST_OTHERS:
                self._others.update(message.name[:_MOST_OTHERS])
            return []
        self._heard = True
        index = message.name.index(self._joint_name)
        told = index < len(message.position) and abs(message.position[index]) <= LARGEST
        measured_ns = time_ns(message.header.stamp) - self._delay_ns
        if not (told and 0 <= measured_ns <= LATEST_NS):
            self._drops[self.MALFORMED] += 1
            return []
        pitch = self._sign * (float(message.position[index]) - self._zero)
        sure = self._order.add(measured_ns, pitch)
        self._count_left_out()
        return sure

    def _count_left_out(self) -> None:
        if self._order.left_out:
            self._drops[self.OUT_OF_ORDER] = self._order.left_out
