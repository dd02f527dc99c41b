"""The parameters of the nod of a joint that ros2_control moves."""

from dataclasses import dataclass

from nodlidar_common.dynamics import Dynamics
from nodlidar_common.parameters import parameter
from nodlidar_servo.nod.joint_config import JointConfig

_MIN_SPEED = 0.01  # rad/s; the least max_speed. A slower nod over a tiny span has countless legs


@dataclass(frozen=True)
class TrajectoryConfig(JointConfig):
    """Controller."""

    controller: str = parameter(
        'joint_trajectory_controller', 'Name of the controller, in the namespace of the node'
    )
    acceleration: float = parameter(
        50.0,
        'Acceleration at the reversals, which the joint must reach with its load; commands that '
        'need more are refused',
        unit='rad/s^2',
        minimum=1.0,
        maximum=1e5,
    )
    max_speed: float = parameter(
        6.0,
        'Highest speed of the joint; commands that need more are refused',
        unit='rad/s',
        minimum=_MIN_SPEED,
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

    @property
    def port(self) -> str:
        """The controller: it takes the place of a device on a port."""
        return self.controller

    @property
    def dynamics(self) -> Dynamics:
        """What the joint can do."""
        return Dynamics(self.acceleration, _MIN_SPEED, self.max_speed)
