"""The control table of an RX or AX servo: registers, defaults, limits, the rules for writing.

An MX-28 with Protocol 1.0 has the same registers, but for its gains in place of the compliance,
which are not emulated.
"""

from dataclasses import dataclass, replace
from enum import IntFlag
import math

from nodlidar_sim.devices.registers import Kind, Register, Registers

SIZE = 50
EEPROM_END = 24

_RPM = math.tau / 60.0  # rad/s


class Errors(IntFlag):
    """The error bits of a status packet."""

    NONE = 0
    VOLTAGE = 0x01
    ANGLE_LIMIT = 0x02
    OVERHEATING = 0x04
    RANGE = 0x08
    CHECKSUM = 0x10
    OVERLOAD = 0x20
    INSTRUCTION = 0x40


MODEL = Register(0, 2, 24)
FIRMWARE = Register(2, 1, 1)
ID = Register(3, 1, 1, 0, 253)
BAUD = Register(4, 1, 34, 0, 254)
RETURN_DELAY = Register(5, 1, 250, 0, 254)
CW_LIMIT = Register(6, 2, 0, 0, 1023)
CCW_LIMIT = Register(8, 2, 1023, 0, 1023)
TEMPERATURE_LIMIT = Register(11, 1, 80, 0, 150)
VOLTAGE_MIN = Register(12, 1, 60, 50, 250)
VOLTAGE_MAX = Register(13, 1, 190, 50, 250)
MAX_TORQUE = Register(14, 2, 1023, 0, 1023)
RETURN_LEVEL = Register(16, 1, 2, 0, 2)
ALARM_LED = Register(17, 1, 36, 0, 127)
SHUTDOWN = Register(18, 1, 36, 0, 127)
TORQUE_ENABLE = Register(24, 1, 0, 0, 1)
LED = Register(25, 1, 0, 0, 1)
CW_MARGIN = Register(26, 1, 1, 0, 255)
CCW_MARGIN = Register(27, 1, 1, 0, 255)
CW_SLOPE = Register(28, 1, 32, 1, 254)
CCW_SLOPE = Register(29, 1, 32, 1, 254)
GOAL = Register(30, 2, 0, 0, 1023)
MOVING_SPEED = Register(32, 2, 0, 0, 2047)
TORQUE_LIMIT = Register(34, 2, 1023, 0, 1023)
POSITION = Register(36, 2, 0)
SPEED = Register(38, 2, 0)
LOAD = Register(40, 2, 0)
VOLTAGE = Register(42, 1, 0)
TEMPERATURE = Register(43, 1, 0)
REGISTERED = Register(44, 1, 0)
MOVING = Register(46, 1, 0)
LOCK = Register(47, 1, 0, 0, 1)
PUNCH = Register(48, 2, 32, 0, 1023)

REGISTERS = tuple(value for value in list(globals().values()) if isinstance(value, Register))


@dataclass(frozen=True, slots=True)
class RxKind(Kind):
    """What differs between servos with this table.

    Attributes
    ----------
    ticks, tick
        Number of positions, and the angle from one to the next [rad].
    speed_unit
        Step of the speed registers [rad/s].
    """

    ticks: int = 1024
    tick: float = math.radians(300.0) / 1024
    speed_unit: float = 0.111 * _RPM


# By the e-manual of each model.
_AX = (BAUD, 1), (VOLTAGE_MAX, 140)
RX24F = RxKind(24, 126.0)
RX28 = RxKind(28, 85.0, 18.5)
RX64 = RxKind(64, 64.0, 18.5)
AX12A = RxKind(12, 59.0, factory=(*_AX, (TEMPERATURE_LIMIT, 70)))
AX18A = RxKind(
    18, 97.0, factory=(*_AX, (TEMPERATURE_LIMIT, 75), (MAX_TORQUE, 983), (TORQUE_LIMIT, 983))
)
MX28 = RxKind(
    29,
    55.0,
    factory=((VOLTAGE_MAX, 160),),
    ticks=4096,
    tick=math.radians(360.0) / 4096,
    speed_unit=0.114 * _RPM,
)


class ControlTable(Registers):
    """The bytes of the table; the rules for writing apply to the host, not to the servo."""

    def __init__(self, kind: RxKind = RX24F) -> None:
        self.kind = kind
        super().__init__([_of_kind(register, kind) for register in REGISTERS], SIZE)

    @property
    def wheel_mode(self) -> bool:
        """Whether the servo turns endlessly: both angle limits are 0."""
        return self[CW_LIMIT] == self[CCW_LIMIT] == 0

    def errors_of(self, address: int, data: bytes) -> Errors:
        """Return the errors that a write of the host would cause."""
        trial = ControlTable(self.kind)
        trial._bytes[:] = self._bytes
        return trial.write(address, data)

    def write(self, address: int, data: bytes) -> Errors:
        """Write bytes if all of them are allowed, else return the errors."""
        if self._forbidden(address, len(data)):
            return Errors.RANGE
        before = bytes(self._bytes)
        self._bytes[address : address + len(data)] = data
        errors = self._range_errors(address, len(data))
        if errors:
            self._bytes[:] = before
        return errors

    def _forbidden(self, address: int, size: int) -> bool:
        """Return whether a write includes a locked or read-only byte, or one outside registers."""
        if address < EEPROM_END and self[TORQUE_ENABLE]:
            return True  # the EEPROM can be written without torque only (e-manual)
        if size < 1 or (self[LOCK] and (address < EEPROM_END or address == LOCK.address)):
            return True
        return not set(range(address, address + size)) <= _WRITABLE

    def _range_errors(self, address: int, size: int) -> Errors:
        errors = Errors.NONE
        for register in self.touched(address, size):
            if register.high is None or not register.low <= self[register] <= register.high:
                errors |= Errors.RANGE
            if register.address == GOAL.address and not self._goal_within_limits():
                errors |= Errors.ANGLE_LIMIT
        return errors

    def _goal_within_limits(self) -> bool:
        return self.wheel_mode or self[CW_LIMIT] <= self[GOAL] <= self[CCW_LIMIT]


def _of_kind(register: Register, kind: RxKind) -> Register:
    """Return a register with the default and the limit that it has in a kind of servo."""
    last = kind.ticks - 1
    defaults = {MODEL: kind.model, CCW_LIMIT: last, **dict(kind.factory)}
    high = last if register in (CW_LIMIT, CCW_LIMIT, GOAL) else register.high
    return replace(register, default=defaults.get(register, register.default), high=high)


_WRITABLE = {
    register.address + i
    for register in REGISTERS
    if register.high is not None
    for i in range(register.size)
}
