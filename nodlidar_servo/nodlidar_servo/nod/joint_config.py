"""The parameters of the nodding joint, whatever moves it."""

from dataclasses import dataclass

from nodlidar_common.dynamics import Dynamics
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter

HALF_TURN = 3.15  # rad, rounded up


@dataclass(frozen=True)
class JointConfig:
    """Joint and commands."""

    joint_name: str = parameter(
        'nod_joint', 'Name of the joint in joint_states, as in the robot description'
    )
    pitch_lower_limit: float = parameter(
        -0.80,
        'Lowest pitch that the mount allows, positive is up; commands beyond are refused',
        unit='rad',
        minimum=-HALF_TURN,
        maximum=HALF_TURN,
    )
    pitch_upper_limit: float = parameter(
        0.80,
        'Highest pitch that the mount allows; commands beyond are refused',
        unit='rad',
        minimum=-HALF_TURN,
        maximum=HALF_TURN,
    )
    command_timeout: float = parameter(
        0.6,
        'Time without an acceptable nod command after which the joint is let go or stopped; at '
        'least twice the time between commands (command_rate of the assembler)',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    reconnect_delay: float = parameter(
        1.0, 'Time between attempts to connect', unit='s', minimum=0.1, maximum=60.0
    )
    autostart: bool = parameter(False, 'Configure and activate the node at start')

    @property
    def pitch_limits(self) -> tuple[float, float]:
        """Lowest and highest pitch that the mount allows [rad]."""
        return self.pitch_lower_limit, self.pitch_upper_limit

    @property
    def dynamics(self) -> Dynamics:
        """What the joint can do with its load."""
        raise NotImplementedError

    def check_together(self) -> None:
        """Check the pitch limits against each other; raises ParameterError."""
        if self.pitch_upper_limit <= self.pitch_lower_limit:
            limit = f'above pitch_lower_limit = {self.pitch_lower_limit} rad'
            raise ParameterError('pitch_upper_limit', limit, self.pitch_upper_limit)
