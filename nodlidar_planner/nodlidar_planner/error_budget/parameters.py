"""The data of devices and robot from which the error of a point follows."""

from dataclasses import dataclass

from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.parameters import check, parameter

# Step, noise and smooth error over the default nod, of a potentiometer with 1024 steps in 300 deg
# and of a magnet with 4096 in 360 deg [rad]. Noise and error are guessed (docs/physics.md).
_POTENTIOMETER = {'encoder_step': 0.005113, 'encoder_noise': 0.0015, 'encoder_error': 0.0037}
_MAGNET = {'encoder_step': 0.001534, 'encoder_noise': 0.00046, 'encoder_error': 0.0029}
SERVO_ERRORS = {
    'RX-24F': _POTENTIOMETER | {'backlash': 0.004},
    'RX-28': _POTENTIOMETER | {'backlash': 0.0058},
    'RX-64': _POTENTIOMETER | {'backlash': 0.0058},
    'AX-12A': _POTENTIOMETER | {'backlash': 0.006},
    'AX-18A': _POTENTIOMETER | {'backlash': 0.006},
    'MX-28': _MAGNET | {'backlash': 0.0058},
    'MX-28-2': _MAGNET | {'backlash': 0.0058},
    'XL430-W250': _MAGNET | {'backlash': 0.0044},
    'XL330-M288': _MAGNET | {'backlash': 0.006},
    'XL330-M077': _MAGNET | {'backlash': 0.006},
    'STS3215': _MAGNET | {'backlash': 0.0152},
}
"""The fields of `ErrorParameters` that differ between servos."""
ESTIMATORS = ('slerp', 'trajectory')


@dataclass(frozen=True, slots=True)
class ErrorParameters:
    """The errors of lidar, servo, mount and odometry; see each field's description.

    The defaults are those of a URG-04LX-UG01 on an RX-24F, as in docs/physics.md, with delays and
    a mount as one measures them by hand.

    Raises
    ------
    ParameterError
        If a value is out of its range.
    """

    range_noise: float = parameter(
        0.006, 'Standard deviation of a range close by', unit='m', minimum=0.0, maximum=1.0
    )
    range_noise_growth: float = parameter(
        0.004, 'Standard deviation of a far range, per metre', minimum=0.0, maximum=0.5
    )
    range_bias: float = parameter(
        0.005,
        'RMS bias of the ranges, over the surfaces of the scene',
        unit='m',
        minimum=0.0,
        maximum=1.0,
    )
    estimator: str = parameter(
        'slerp', 'Estimator of the pitch, slerp or trajectory', choices=ESTIMATORS
    )
    joint_rate: float = parameter(
        100.0, 'Joint states per second', unit='Hz', minimum=1.0, maximum=1e4
    )
    encoder_step: float = parameter(
        0.005113, 'Step of the encoder', unit='rad', minimum=1e-7, maximum=0.1
    )
    encoder_noise: float = parameter(
        0.0015,
        'Standard deviation of the encoder before rounding',
        unit='rad',
        minimum=0.0,
        maximum=0.1,
    )
    encoder_error: float = parameter(
        0.0037,
        'RMS smooth error of the encoder over the nod, with its mean, a wrong zero',
        unit='rad',
        minimum=0.0,
        maximum=0.1,
    )
    backlash: float = parameter(
        0.004, 'Free play between encoder and lidar', unit='rad', minimum=0.0, maximum=0.1
    )
    deflection: float = parameter(
        0.0003,
        'RMS deflection of gear and bracket by the load, torque by stiffness',
        unit='rad',
        minimum=0.0,
        maximum=0.1,
    )
    reversal_acceleration: float = parameter(
        REVERSAL_ACCELERATION,
        'Acceleration of the reversals',
        unit='rad/s^2',
        minimum=0.1,
        maximum=1e5,
    )
    joint_delay_error: float = parameter(
        0.0005,
        'Standard deviation of the delay of the joint states',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    scan_delay_error: float = parameter(
        0.0005,
        'Standard deviation of the delay of the scans',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    mount_position_error: float = parameter(
        0.001,
        "Standard deviation of each coordinate of the lidar's place",
        unit='m',
        minimum=0.0,
        maximum=1.0,
    )
    mount_angle_error: float = parameter(
        0.002,
        'Standard deviation of its roll, pitch and yaw, each',
        unit='rad',
        minimum=0.0,
        maximum=1.0,
    )
    laser_above: float = parameter(
        0.08,
        'Height of the optical centre above the nod axis, at pitch 0',
        unit='m',
        minimum=-10.0,
        maximum=10.0,
    )
    laser_ahead: float = parameter(
        0.0,
        'Distance of the optical centre ahead of the nod axis, at pitch 0',
        unit='m',
        minimum=-10.0,
        maximum=10.0,
    )
    mount_ahead: float = parameter(
        0.0,
        'Distance of the nod axis ahead of the point about which the robot turns',
        unit='m',
        minimum=-10.0,
        maximum=10.0,
    )
    robot_speed: float = parameter(
        0.0, 'Speed of the robot', unit='m/s', minimum=0.0, maximum=100.0
    )
    robot_turn_rate: float = parameter(
        0.0, 'Turn rate of the robot', unit='rad/s', minimum=0.0, maximum=100.0
    )
    odometry_speed_error: float = parameter(
        0.0,
        'Standard deviation of the speed by odometry; the speed itself without compensation',
        unit='m/s',
        minimum=0.0,
        maximum=100.0,
    )
    odometry_turn_error: float = parameter(
        0.0,
        'Standard deviation of the turn rate by odometry; the rate itself without compensation',
        unit='rad/s',
        minimum=0.0,
        maximum=100.0,
    )
    cloud_time: float = parameter(
        0.74, 'Time from the first to the last point of a cloud', unit='s', minimum=0.0,
        maximum=1000.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self)
