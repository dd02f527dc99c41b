"""The servo's parameters."""

from dataclasses import dataclass

from nodlidar_common.dynamics import Dynamics, REVERSAL_ACCELERATION
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_servo.models.models import MODELS, PitchScale
from nodlidar_servo.nod.joint_config import JointConfig


@dataclass(frozen=True)
class ServoConfig(JointConfig):
    """Servo and bus."""

    port: str = parameter(
        '/dev/ttyUSB0', 'Serial port of the servo; /dev/serial/by-id has stable names'
    )
    baud_rate: int = parameter(
        1_000_000,
        'Bit rate of the bus; an RX-24F leaves the factory with 57600: set it to 1 M once',
        unit='bit/s',
        minimum=9600,
        maximum=4_000_000,
    )
    servo_id: int = parameter(1, 'ID of the servo; 1 from the factory', minimum=0, maximum=252)
    model: str = parameter('RX-24F', 'Model of the servo', choices=tuple(MODELS))
    zero_tick: int = parameter(
        -1,
        'Position of the servo at which the scan plane is level; -1: the middle, 512 of 1024 '
        'steps, 2048 of 4096',
        minimum=-1,
        maximum=4095,
    )
    invert: bool = parameter(False, 'The beams go down as the position of the servo rises')
    acceleration: float = parameter(
        REVERSAL_ACCELERATION,
        'Acceleration that the servo reaches with its load; commands that need more are refused',
        unit='rad/s^2',
        minimum=1.0,
        maximum=1e5,
    )
    torque_limit: float = parameter(
        1.0, 'Torque limit as a share of the maximum torque', minimum=0.05, maximum=1.0
    )
    position_gain: int = parameter(
        0,
        'P gain of the position loop of a servo of Protocol 2.0, until its power goes; 0: 1200 '
        'for an XL330, whose own 400 are too weak for a lidar, else as it is',
        minimum=0,
        maximum=16383,
    )
    feedback_rate: float = parameter(
        100.0,
        'Joint states per second; an adapter with a latency timer of 16 ms gives some 62. The '
        'launch argument profile:=fast sets 16',
        unit='Hz',
        minimum=10.0,
        maximum=1000.0,
    )
    following_error: float = parameter(
        0.2,
        'Largest distance between the servo and a model of it that obeys the same commands, '
        'beyond 20 ms of motion; at most a sixth of the span of the nod counts',
        unit='rad',
        minimum=0.02,
        maximum=3.0,
    )
    following_error_time: float = parameter(
        0.4,
        'Time beyond following_error after which the torque is cut',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )

    def check_together(self) -> None:
        """Check the pitch limits against the servo; raises ParameterError."""
        low, high = self.scale.pitch_range
        for key in ('pitch_lower_limit', 'pitch_upper_limit'):
            if not low <= getattr(self, key) <= high:
                limit = f'between {low:.4f} and {high:.4f} rad, the range of the servo'
                raise ParameterError(key, limit, getattr(self, key))
        if self.position_gain and 'position gain' not in self.scale.model.table.registers:
            limit = f'0 for a servo {self.model}, which has no such register'
            raise ParameterError('position_gain', limit, self.position_gain)

    @property
    def scale(self) -> PitchScale:
        """Conversion between ticks and pitch, for the mounted servo."""
        model = MODELS[self.model]
        zero = model.ticks // 2 if self.zero_tick < 0 else self.zero_tick
        return PitchScale(model, zero, self.invert)

    @property
    def dynamics(self) -> Dynamics:
        """What the servo can do with its load."""
        model = MODELS[self.model]
        return Dynamics(self.acceleration, model.speed_unit, model.fastest)
