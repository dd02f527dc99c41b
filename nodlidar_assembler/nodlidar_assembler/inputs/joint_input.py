"""JointState messages as samples of the nod joint."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

from nodlidar_assembler.clouds.joint_history import JointSamplesConfig
from nodlidar_assembler.clouds.pitch import LARGEST
from nodlidar_assembler.inputs.joint_axis import JointAxis
from nodlidar_assembler.inputs.joint_strays import JointStrays
from nodlidar_assembler.plausibility.joint_scatter import JointScatter
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import LATEST_NS, NS_PER_S, time_ns
from nodlidar_common.time_order import TimeOrder

# Names of other joints in the message about the missing one.
_MOST_OTHERS = 20


@dataclass(frozen=True)
class JointInputConfig(JointSamplesConfig):
    """Joint state messages."""

    joint_name: str = parameter('nod_joint', 'Joint whose position is the pitch of the scan plane')
    joint_positive: str = parameter(
        'up',
        'Direction in which the beams turn as the joint position rises: up (axis 0 -1 0, as in '
        'nodlidar_bringup) or down (axis 0 1 0, as on many tilting lidars); '
        'the nod is commanded so, too',
        choices=('up', 'down'),
    )
    joint_zero: float = parameter(
        0.0,
        'Joint position at pitch 0; the nod is commanded so, too',
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

    @property
    def joint_axis(self) -> JointAxis:
        """How the scan plane turns with the joint."""
        return JointAxis(1.0 if self.joint_positive == 'up' else -1.0, self.joint_zero)


class JointInput:
    """Finds the samples of one joint in joint states, and counts the malformed ones.

    Messages without that joint belong to others on the same topic and are ignored. Samples are
    returned in ascending time, except for the first after time went back.

    Parameters
    ----------
    config
        Name of the joint, zero and direction of its positions, delay of its stamps.
    drops
        Counter of malformed, unstamped, misordered, stray and contradictory joint states.

    Attributes
    ----------
    scatter
        Of the samples.
    """

    MALFORMED = (
        f'joint state without a position up to {LARGEST:g} rad or a stamp between 1970 and 2038'
    )
    UNSTAMPED = 'joint state without a stamp'
    OUT_OF_ORDER = 'joint state whose stamp does not fit its neighbours'
    TWICE = 'joint state that has the joint twice'
    STRAY = 'joint state at a position from which the joint cannot have come back'
    SAME_STAMP = 'joint state with the stamp of the one before at another position'

    def __init__(self, config: JointInputConfig, drops: Counter[str]) -> None:
        self.scatter = JointScatter(config.joint_name)
        self._joint_name, self._axis = config.joint_name, config.joint_axis
        self._delay_ns = round(config.joint_delay * NS_PER_S)
        self._drops = drops
        self._order: TimeOrder[tuple[int, float]] = TimeOrder(
            lambda: drops.update([self.OUT_OF_ORDER]), round(config.max_joint_gap * NS_PER_S)
        )
        self._strays = JointStrays(lambda: drops.update([self.STRAY]))
        self._last: tuple[int, float] | None = None
        self._heard = False
        self._others: set[str] = set()

    @property
    def missing_input(self) -> str:
        """Why there is no joint state with the joint; empty if there was one."""
        if self._heard:
            return ''
        if not self._others:
            return 'no joint state was heard'
        others = ', '.join(f"'{name}'" for name in sorted(self._others))
        return f"no joint state contains '{self._joint_name}', only {others}: set joint_name"

    def restart(self) -> None:
        """Restart after the clock was set: the next sample may be of any time."""
        self._order.restart()
        self._strays.restart()

    def has_joint(self, message: Any) -> bool:
        """Return whether a message contains the nod joint."""
        return self._joint_name in message.name

    def samples(self, message: Any) -> list[tuple[int, float]]:
        """Take a joint state; return the samples [ns], [rad] that are confirmed by it."""
        if not self.has_joint(message):
            if len(self._others) < _MOST_OTHERS:
                self._others.update(message.name[:_MOST_OTHERS])
            return []
        self._heard = True
        if not time_ns(message.header.stamp):
            self._drops[self.UNSTAMPED] += 1
            return []
        if message.name.count(self._joint_name) > 1:
            self._drops[self.TWICE] += 1
            return []
        index = message.name.index(self._joint_name)
        has_position = index < len(message.position) and abs(message.position[index]) <= LARGEST
        measured_ns = time_ns(message.header.stamp) - self._delay_ns
        if not (has_position and 0 <= measured_ns <= LATEST_NS):
            self._drops[self.MALFORMED] += 1
            return []
        sample = measured_ns, self._axis.pitch(float(message.position[index]))
        if self._last is not None and self._last[0] == measured_ns and self._last != sample:
            self._drops[self.SAME_STAMP] += 1
            return []
        self._last = sample
        in_order = self._order.add(measured_ns, sample)
        confirmed = [one for each in in_order for one in self._strays.add(each)]
        for each in confirmed:
            self.scatter.add(each)
        return confirmed
