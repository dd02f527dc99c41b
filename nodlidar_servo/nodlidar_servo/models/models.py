"""The supported servo models, and the units of their registers."""

from dataclasses import dataclass, replace
import math

from nodlidar_servo.models.control_table import ControlTable, TABLE_1, TABLE_2
from nodlidar_servo.models.sts_table import TABLE_STS


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
    max_torque
        Torque at standstill at the nominal voltage [Nm].
    table
        Its registers.
    most_load
        Count of the load register at the maximum torque, or at the limit of the current.
    position_gain
        P gain that it needs to carry a lidar, 0 if that of the factory will do.
    """

    name: str
    number: int
    ticks: int
    tick_angle: float
    speed_unit: float
    max_speed: float
    max_torque: float
    table: ControlTable = TABLE_1
    most_load: int = 1023
    position_gain: int = 0

    @property
    def fastest(self) -> float:
        """Highest speed that can be commanded [rad/s]; the register may limit the motor's."""
        return min(self.max_speed, self.table.most_speed * self.speed_unit)

    def speed_counts(self, speed: float) -> int:
        """Return the register of the speed to the goal for a speed [rad/s].

        Never 0, which means 'as fast as possible', and at most the end of the register.
        """
        return min(max(round(speed / self.speed_unit), 1), self.table.most_speed)


def _rpm(value: float) -> float:
    return value * 2.0 * math.pi / 60.0


_STEP_300, _STEP_360 = math.radians(300.0) / 1024, math.radians(360.0) / 4096  # rad
_UNIT_1, _UNIT_MX, _UNIT_2 = _rpm(0.111), _rpm(0.114), _rpm(0.229)  # rad/s


def _series_1(name: str, number: int, rpm: float, torque: float) -> ServoModel:
    """Return an AX or RX servo."""
    return ServoModel(name, number, 1024, _STEP_300, _UNIT_1, _rpm(rpm), torque)


def _series_2(name: str, number: int, rpm: float, torque: float) -> ServoModel:
    """Return an X or MX servo with Protocol 2.0."""
    return ServoModel(name, number, 4096, _STEP_360, _UNIT_2, _rpm(rpm), torque, TABLE_2, 1000)


def _xl330(name: str, number: int, rpm: float, torque: float) -> ServoModel:
    """Return an XL330, whose load is the current, in units of 1 mA of at most 1750.

    With the 400 of the factory, its position loop gives way by 0.15 rad to a URG-04LX-UG01.
    """
    servo = _series_2(name, number, rpm, torque)
    return replace(servo, most_load=1750, position_gain=1200)


# Speeds without load and torques at standstill by the e-manual: AX-12A, AX-18A and RX-24F at 12 V,
# RX-28 and RX-64 at 18.5 V, XL430 and MX-28 at 12 V, XL330 at 5 V. STS3215 by Feetech: the speed
# at 7.4 or 12 V, its variant, the torque at 12 V.
MODELS = {
    model.name: model
    for model in (
        _series_1('RX-24F', 24, 126.0, 2.6),
        _series_1('RX-28', 28, 85.0, 3.7),
        _series_1('RX-64', 64, 64.0, 5.3),
        _series_1('AX-12A', 12, 59.0, 1.5),
        _series_1('AX-18A', 18, 97.0, 1.8),
        ServoModel('MX-28', 29, 4096, _STEP_360, _UNIT_MX, _rpm(55.0), 2.5),
        _series_2('MX-28-2', 30, 55.0, 2.5),
        _series_2('XL430-W250', 1060, 61.0, 1.5),
        _xl330('XL330-M288', 1200, 103.0, 0.52),
        _xl330('XL330-M077', 1190, 383.0, 0.215),
        ServoModel('STS3215', 777, 4096, _STEP_360, _STEP_360, _rpm(45.0), 2.94, TABLE_STS, 1000),
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
        """Return the tick nearest to a pitch [rad]; the caller keeps that in `pitch_range`."""
        return self.zero_tick + round(self.sign * pitch / self.model.tick_angle)
