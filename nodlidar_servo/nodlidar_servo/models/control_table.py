"""The registers of the servos: where they are, and what they mean.

Protocol 1.0: RX, AX and MX series; 2.0: X series and MX with newer firmware (ROBOTIS e-manual of
each model; the model files of dynamixel_hardware_interface have the same addresses).
"""

from dataclasses import dataclass
import struct

from nodlidar_servo.bus.packets import PacketFormat, PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.bus.replies import HARDWARE_ERRORS

CLOCKWISE_BIT = 0x400
"""In present speed and load of Protocol 1.0: set for clockwise (falling ticks)."""

_EEPROM_1 = struct.Struct('<H3xBHHxBBBHBxB')  # 0..18
_EEPROM_2 = struct.Struct('<H7xBBB19xBHHH10xII7xB4xB')  # 0..68: model number to return level
PRESENT_1 = struct.Struct('<HHHBB')  # 36..43: position, speed, load, voltage, temperature
_PRESENT_2 = struct.Struct('<hii8xHB')  # 126..146: load, velocity, position, voltage, temperature
_DRIVE_1 = struct.Struct('<HH')  # goal, moving speed
_DRIVE_2 = struct.Struct('<II')  # profile velocity, goal
_POSITION_MODE = 3
TIME_BASED, REVERSED = 0x04, 0x01  # bits of the drive mode of Protocol 2.0


@dataclass(frozen=True, slots=True)
class SetUp:
    """What a servo is set up to.

    Attributes
    ----------
    number
        Model number.
    return_delay
        Content of that register; both protocols count 2 us.
    low, high
        Limits of the position [ticks].
    temperature, voltage_min, voltage_max
        Limits [deg C], [V].
    most_torque
        Highest value of the register of the torque limit.
    return_level
        `reply_to_all` of the table: all requests are answered.
    shutdown
        Status bits that cut the torque.
    wrong_mode
        Why positions cannot be commanded, empty if they can.
    """

    number: int
    return_delay: int
    low: int
    high: int
    temperature: int
    voltage_min: float
    voltage_max: float
    most_torque: int
    return_level: int
    shutdown: int
    wrong_mode: str


@dataclass(frozen=True, slots=True)
class Present:
    """What a servo measures: position [ticks], counts of speed and load, [V], [deg C].

    Speed and load are positive for rising ticks.
    """

    position: int
    speed: int
    load: int
    voltage: float
    temperature: int


@dataclass(frozen=True)
class ControlTable:
    """The registers of a series of models, by their first addresses.

    Attributes
    ----------
    packets
        The protocol.
    return_delay, most_torque, return_level, torque_enable, torque_limit
        Registers of that name; the torque limit of Protocol 2.0 is Goal PWM, its highest value the
        PWM Limit.
    hardware_error
        Register of the alarms, None if the status byte has them.
    watchdog
        Register of the bus watchdog, None without one.
    position_gain
        Register of the P gain of the position loop, None where it is not in RAM.
    drive
        Of the block of goal and speed.
    present, present_size
        Of the block that measures.
    set_up_size
        Bytes of the block from address 0 with what the servo is set up to.
    most_speed
        Highest value of the speed's register.
    reply_to_all
        Value of the return level with which all requests are answered.
    """

    packets: PacketFormat
    return_delay: int
    most_torque: int
    return_level: int
    torque_enable: int
    torque_limit: int
    hardware_error: int | None
    watchdog: int | None
    position_gain: int | None
    drive: int
    present: int
    present_size: int
    set_up_size: int
    most_speed: int
    reply_to_all: int = 2

    def parse_set_up(self, data: bytes) -> SetUp:
        """Return what the servo is set up to."""
        raise NotImplementedError

    def parse_present(self, data: bytes) -> Present:
        """Return what the servo measures."""
        raise NotImplementedError

    def goal(self, tick: int, speed: int) -> bytes:
        """Return the block of goal [ticks] and speed [counts]."""
        raise NotImplementedError


class _Table1(ControlTable):
    def parse_set_up(self, data: bytes) -> SetUp:
        number, delay, low, high, hottest, least, most, torque, level, shutdown = _EEPROM_1.unpack(
            data
        )
        wrong = ''
        if low == high == 0:
            wrong = 'in wheel mode: set its CW and CCW angle limits (addresses 6 and 8)'
        voltages = least / 10.0, most / 10.0
        return SetUp(number, delay, low, high, hottest, *voltages, torque, level, shutdown, wrong)

    def parse_present(self, data: bytes) -> Present:
        position, speed, load, voltage, temperature = PRESENT_1.unpack(data)
        return Present(position, signed(speed), signed(load), voltage / 10.0, temperature)

    def goal(self, tick: int, speed: int) -> bytes:
        return _DRIVE_1.pack(tick, speed)


class _Table2(ControlTable):
    def parse_set_up(self, data: bytes) -> SetUp:
        number, delay, drive, mode, hottest, most, least, pwm, high, low, shutdown, level = (
            _EEPROM_2.unpack(data)
        )
        wrong = ''
        if mode != _POSITION_MODE:
            wrong = f'in operating mode {mode} (address 11): set it to 3, position control'
        elif drive & (TIME_BASED | REVERSED):
            wrong = f'in drive mode {drive} (address 10): set it to 0'
        voltages = least / 10.0, most / 10.0
        shutdown <<= HARDWARE_ERRORS
        return SetUp(number, delay, low, high, hottest, *voltages, pwm, level, shutdown, wrong)

    def parse_present(self, data: bytes) -> Present:
        load, velocity, position, voltage, temperature = _PRESENT_2.unpack(data)
        return Present(position, velocity, load, voltage / 10.0, temperature)

    def goal(self, tick: int, speed: int) -> bytes:
        return _DRIVE_2.pack(speed, tick)


TABLE_1 = _Table1(
    PROTOCOL_1,
    return_delay=5,
    most_torque=14,
    return_level=16,
    torque_enable=24,
    torque_limit=34,
    hardware_error=None,
    watchdog=None,
    position_gain=None,
    drive=30,
    present=36,
    present_size=PRESENT_1.size,
    set_up_size=_EEPROM_1.size,
    most_speed=CLOCKWISE_BIT - 1,
)
TABLE_2 = _Table2(
    PROTOCOL_2,
    return_delay=9,
    most_torque=36,
    return_level=68,
    torque_enable=64,
    torque_limit=100,
    hardware_error=70,
    watchdog=98,
    position_gain=84,
    drive=112,
    present=126,
    present_size=_PRESENT_2.size,
    set_up_size=_EEPROM_2.size,
    most_speed=0x7FFF,
)


def signed(register: int, sign: int = CLOCKWISE_BIT) -> int:
    """Return the value of a register with a sign bit, positive for rising ticks."""
    value = register & (sign - 1)
    return -value if register & sign else value
