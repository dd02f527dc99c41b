"""The supported servo models, and the units of their registers.

All models use Protocol 1.0 and share the registers used here (ROBOTIS e-manual, RX-24F). They
differ in the number of ticks, the speed unit and the speed.
"""

from dataclasses import dataclass
from enum import IntEnum
import math

VALUE_BITS = 0x3FF
CLOCKWISE_BIT = 0x400
"""In present speed and load: bit 10 is the direction, set for clockwise (falling ticks)."""


class Register(IntEnum):
    """First addresses of the control table; those below TORQUE_ENABLE are EEPROM."""

    MODEL = 0
    RETURN_DELAY = 5
    RETURN_LEVEL = 16
    TORQUE_ENABLE = 24
    GOAL = 30
    TORQUE_LIMIT = 34
    PRESENT = 36


@dataclass(frozen=True, slots=True)
class ServoModel:
    """One servo model.

    Attributes
    ----------
    name, number
        Name, and content of the model number register.
    ticks
        Number of positions; the last one is ticks - 1.
    tick_angle
        One tick [rad].
    speed_unit
        One count of the speed registers [rad/s].
    max_speed
        No-load speed at the nominal voltage [rad/s].
    """

    name: str
    number: int
    ticks: int
    tick_angle: float
    speed_unit: float
    max_speed: float

    @property
    def fastest(self) -> float:
        """Highest speed that can be commanded [rad/s]; the register may limit the motor's."""
        return min(self.max_speed, VALUE_BITS * self.speed_unit)

    def speed_counts(self, speed: float) -> int:
        """Return the moving-speed register for a speed [rad/s].

        Never 0, which means 'as fast as possible', and at most 1023, the end of the register.
        """
        return min(max(round(speed / self.speed_unit), 1), VALUE_BITS)

    def velocity(self, register: int) -> float:
        """Return the velocity [rad/s], positive for rising ticks, of a present-speed register."""
        return signed(register) * self.speed_unit


def signed(register: int) -> int:
    """Return the value of a present speed or load register, positive for rising ticks."""
    value = register & VALUE_BITS
    return -value if register & CLOCKWISE_BIT else value


def load_share(register: int) -> float:
    """Return a load register as a share of the maximum torque, -1 to 1."""
    return signed(register) / VALUE_BITS


def _rpm(value: float) -> float:
    return value * 2.0 * math.pi / 60.0


MODELS = {
    model.name: model
    for model in (
        ServoModel('RX-24F', 24, 1024, math.radians(300.0) / 1024, _rpm(0.111), _rpm(126.0)),
        ServoModel('AX-12A', 12, 1024, math.radians(300.0) / 1024, _rpm(0.111), _rpm(59.0)),
        ServoModel('MX-28', 29, 4096, math.radians(360.0) / 4096, _rpm(0.114), _rpm(55.0)),
    )
}


@dataclass(frozen=True, slots=True)
class PitchScale:
    """Conversion between ticks and pitch, for a mounted servo.

    Attributes
    ----------
    model
        The servo.
    zero_tick
        The tick at which the scan plane is level.
    invert
        Whether the beam goes down when ticks rise.
    """

    model: ServoModel
    zero_tick: int
    invert: bool

    @property
    def sign(self) -> int:
        """Direction of the pitch when ticks rise."""
        return -1 if self.invert else 1

    def pitch(self, tick: int) -> float:
        """Return the pitch [rad], positive up, of a tick."""
        return self.sign * (tick - self.zero_tick) * self.model.tick_angle

    @property
    def pitch_range(self) -> tuple[float, float]:
        """Lowest and highest pitch [rad] of the servo's range."""
        low, high = sorted((self.pitch(0), self.pitch(self.model.ticks - 1)))
        return low, high

    def tick(self, pitch: float) -> int:
        """Return the tick nearest to a pitch [rad] within the servo's range."""
        return self.zero_tick + round(self.sign * pitch / self.model.tick_angle)
