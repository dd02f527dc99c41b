"""The parameters of the nod of a joint that ros2_control moves."""

from dataclasses import dataclass

from nodlidar_common.dynamics import Dynamics
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter


@dataclass(frozen=True, slots=True)
class TrajectoryConfig:
    """Joint and controller."""

    controller: str = parameter(
        'joint_trajectory_controller', 'Name of the controller, in the namespace of the node'
    )
    joint_name: str = parameter(
        'nod_joint', 'Name of the joint in joint_states, as in the robot description'
    )
    pitch_lower_limit: float = parameter(
        -0.80,
        'Lowest pitch that the mount allows, positive is up; commands beyond are refused',
        unit='rad',
    )
    pitch_upper_limit: float = parameter(
        0.80, 'Highest pitch that the mount allows; commands beyond are refused', unit='rad'
    )
    acceleration: float = parameter(
        50.0,
        'Acceleration at the reversals, which the joint must reach with its load; commands that '
        'need more are refused',
        unit='rad/s^2',
        minimum=1.0,
    )
    max_speed: float = parameter(
        6.0,
        'Highest speed of the joint; commands that need more are refused',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    send_rate: float = parameter(
        10.0,
        'Trajectories sent to the controller per second',
        unit='Hz',
        minimum=2.0,
        maximum=100.0,
    )
    joint_timeout: float = parameter(
        0.5,
        'Time without joint states after which no trajectory is sent; the joint then rests at a '
        'reversal',
        unit='s',
        minimum=0.05,
        maximum=10.0,
    )
    command_timeout: float = parameter(
        0.6,
        'Time without an acceptable nod command after which the joint is stopped; at least twice '
        'the time between commands (command_rate of the assembler)',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    reconnect_delay: float = parameter(
        1.0, 'Time between attempts to find the controller', unit='s', minimum=0.1
    )
    autostart: bool = parameter(False, 'Configure and activate the node at start')

    def check_together(self) -> None:
        """Check the pitch limits against each other; raises ParameterError."""
        if self.pitch_upper_limit <= self.pitch_lower_limit:
            limit = f'above pitch_lower_limit = {self.pitch_lower_limit} rad'
            raise ParameterError('pitch_upper_limit', limit, self.pitch_upper_limit)

    @property
    def port(self) -> str:
        """The controller: it takes the place of a device on a port."""
        return self.controller

    @property
    def dynamics(self) -> Dynamics:
        """What the joint can do."""
        return Dynamics(self.acceleration, 0.0, self.max_speed)
