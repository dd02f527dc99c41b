"""What the user can set; each field is a parameter of the node."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_servo.models import MODELS, PitchScale


@dataclass(frozen=True, slots=True)
class ServoConfig:
    """Configuration of the servo node."""

    port: str = parameter('/dev/ttyUSB0', 'Serial port of the servo')
    baud_rate: int = parameter(
        1_000_000,
        'Bit rate that the servo is set to',
        unit='bit/s',
        minimum=9600,
        maximum=4_000_000,
    )
    servo_id: int = parameter(1, 'ID of the servo on its bus', minimum=0, maximum=252)
    model: str = parameter('RX-24F', 'Model of the servo', choices=tuple(MODELS))
    joint_name: str = parameter('nod_joint', 'Name of the joint in joint_states')
    zero_tick: int = parameter(
        512, 'Position of the servo at which the scan plane is level', minimum=0, maximum=4095
    )
    invert: bool = parameter(False, 'Whether the beam goes down when the position rises')
    pitch_lower_limit: float = parameter(
        -0.80, 'Lowest pitch that the mount allows, positive is up', unit='rad'
    )
    pitch_upper_limit: float = parameter(
        0.80, 'Highest pitch that the mount allows, positive is up', unit='rad'
    )
    acceleration: float = parameter(
        200.0, 'Acceleration that the servo reaches with its load', unit='rad/s^2', minimum=1.0
    )
    torque_limit: float = parameter(
        1.0, 'Torque limit as a share of the most it can', minimum=0.05, maximum=1.0
    )
    feedback_rate: float = parameter(
        100.0,
        'Joint states per second, if the port gives as many',
        unit='Hz',
        minimum=10.0,
        maximum=1000.0,
    )
    command_timeout: float = parameter(
        0.6,
        'Time without an acceptable nod command after which the torque is cut',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    following_error: float = parameter(
        0.2,
        'Distance from where it is told to be at which the servo does not follow, or a sixth of '
        'the span if that is less',
        unit='rad',
        minimum=0.02,
        maximum=3.0,
    )
    following_error_time: float = parameter(
        0.4,
        'Time for which a servo may not follow before its torque is cut',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    reconnect_delay: float = parameter(
        1.0, 'Time between attempts to connect', unit='s', minimum=0.1
    )
    autostart: bool = parameter(
        False, 'Configure and activate at start, without waiting to be told'
    )

    def check_together(self) -> None:
        """Check what involves several fields; raises ParameterError."""
        if self.pitch_upper_limit <= self.pitch_lower_limit:
            limit = f'above pitch_lower_limit = {self.pitch_lower_limit} rad'
            raise ParameterError('pitch_upper_limit', limit, self.pitch_upper_limit)
        low, high = self.scale.pitch_range
        for key in ('pitch_lower_limit', 'pitch_upper_limit'):
            if not low <= getattr(self, key) <= high:
                limit = f'between {low:.4f} and {high:.4f} rad, the range of the servo'
                raise ParameterError(key, limit, getattr(self, key))

    @property
    def scale(self) -> PitchScale:
        """Ticks to pitch and back, as the servo is mounted."""
        return PitchScale(MODELS[self.model], self.zero_tick, self.invert)
