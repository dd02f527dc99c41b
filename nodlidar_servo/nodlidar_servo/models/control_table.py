"""The registers of the servos: where they are, and what they mean.

Protocol 1.0: RX, AX and MX series; 2.0: X series and MX with newer firmware (ROBOTIS e-manual of
each model; the model files of dynamixel_hardware_interface have the same addresses).
"""

from collections.abc import Mapping
from dataclasses import dataclass
import struct

from nodlidar_servo.bus.packets import PacketFormat, PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.bus.replies import HARDWARE_ERRORS

CLOCKWISE_BIT = 0x400
"""In present speed and load of Protocol 1.0: set for clockwise (falling ticks)."""

PRESENT_1 = struct.Struct('<HHHBB')  # 36..43: position, speed, load, voltage, temperature
_PRESENT_2 = struct.Struct('<hii8xHB')  # 126..146: load, velocity, position, voltage, temperature
_DRIVE_1 = struct.Struct('<HH')  # goal, moving speed
_DRIVE_2 = struct.Struct('<II')  # profile velocity, goal
TIME_BASED, REVERSED = 0x04, 0x01  # bits of the drive mode of Protocol 2.0


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


@dataclass(frozen=True, eq=False)
class ControlTable:
    """The registers of a series of models.

    Attributes
    ----------
    packets
        The protocol.
    registers
        First address and size [bytes] of each, by name; a series lacks some. The torque limit of
        Protocol 2.0 is Goal PWM, its highest value the PWM Limit.
    set_up_size
        Bytes of the block from address 0 with what the servo is set up to.
    drive
        Address of the block of goal and speed.
    present, present_size
        Of the block that measures.
    most_speed
        Highest value of the speed's register.
    reply_to_all
        Value of the return level with which all requests are answered.
    position_mode
        Operating mode of position control; None without such a register.
    alarm_shift
        Bits by which its alarms are shifted in `replies.STATUS_BITS`.
    """

    packets: PacketFormat
    registers: Mapping[str, tuple[int, int]]
    set_up_size: int
    drive: int
    present: int
    present_size: int
    most_speed: int
    reply_to_all: int = 2
    position_mode: int | None = None
    alarm_shift: int = 0

    @property
    def size(self) -> int:
        """Bytes from address 0 to the last of the registers."""
        return max(address + size for address, size in self.registers.values())

    def address(self, name: str) -> int:
        """Return the first address of a register."""
        return self.registers[name][0]

    def encoded(self, name: str, value: int) -> tuple[int, bytes]:
        """Return the first address of a register, and the bytes of a value."""
        address, size = self.registers[name]
        return address, value.to_bytes(size, 'little')

    def values(self, data: bytes) -> dict[str, int]:
        """Return the registers that the bytes from address 0 on contain, by name."""
        return {
            name: int.from_bytes(data[address : address + size], 'little', signed=size == 4)
            for name, (address, size) in self.registers.items()
            if address + size <= len(data)
        }

    def wrong_mode(self, values: Mapping[str, int]) -> str:
        """Return why positions cannot be commanded, by `values`; empty if they can."""
        raise NotImplementedError

    def parse_present(self, data: bytes) -> Present:
        """Return what the servo measures."""
        raise NotImplementedError

    def goal(self, tick: int, speed: int) -> bytes:
        """Return the block of goal [ticks] and speed [counts]."""
        raise NotImplementedError


class _Table1(ControlTable):
    def wrong_mode(self, values: Mapping[str, int]) -> str:
        if values['lower limit'] == values['upper limit'] == 0:
            return 'in wheel mode: set its CW and CCW angle limits (addresses 6 and 8)'
        return ''

    def parse_present(self, data: bytes) -> Present:
        position, speed, load, voltage, temperature = PRESENT_1.unpack(data)
        return Present(position, signed(speed), signed(load), voltage / 10.0, temperature)

    def goal(self, tick: int, speed: int) -> bytes:
        return _DRIVE_1.pack(tick, speed)


class _Table2(ControlTable):
    def wrong_mode(self, values: Mapping[str, int]) -> str:
        mode, drive = values['operating mode'], values['drive mode']
        if mode != self.position_mode:
            return f'in operating mode {mode} (address 11): set it to 3, position control'
        if drive & (TIME_BASED | REVERSED):
            return f'in drive mode {drive} (address 10): set it to 0'
        return ''

    def parse_present(self, data: bytes) -> Present:
        load, velocity, position, voltage, temperature = _PRESENT_2.unpack(data)
        return Present(position, velocity, load, voltage / 10.0, temperature)

    def goal(self, tick: int, speed: int) -> bytes:
        return _DRIVE_2.pack(speed, tick)


_REGISTERS_1 = {
    'model number': (0, 2), 'firmware': (2, 1), 'ID': (3, 1), 'bit rate': (4, 1),
    'return delay': (5, 1), 'lower limit': (6, 2), 'upper limit': (8, 2), 'hottest': (11, 1),
    'lowest voltage': (12, 1), 'highest voltage': (13, 1), 'most torque': (14, 2),
    'return level': (16, 1), 'shutdown': (18, 1), 'torque': (24, 1), 'torque limit': (34, 2),
    'position': (36, 2), 'voltage': (42, 1), 'temperature': (43, 1), 'lock': (47, 1),
}  # fmt: skip
_REGISTERS_2 = {
    'model number': (0, 2), 'firmware': (6, 1), 'ID': (7, 1), 'bit rate': (8, 1),
    'return delay': (9, 1), 'drive mode': (10, 1), 'operating mode': (11, 1), 'hottest': (31, 1),
    'highest voltage': (32, 2), 'lowest voltage': (34, 2), 'most torque': (36, 2),
    'upper limit': (48, 4), 'lower limit': (52, 4), 'shutdown': (63, 1), 'torque': (64, 1),
    'return level': (68, 1), 'errors': (70, 1), 'position gain': (84, 2), 'watchdog': (98, 1),
    'torque limit': (100, 2), 'position': (132, 4), 'voltage': (144, 2), 'temperature': (146, 1),
}  # fmt: skip
TABLE_1 = _Table1(
    PROTOCOL_1,
    _REGISTERS_1,
    set_up_size=19,
    drive=30,
    present=36,
    present_size=PRESENT_1.size,
    most_speed=CLOCKWISE_BIT - 1,
)
TABLE_2 = _Table2(
    PROTOCOL_2,
    _REGISTERS_2,
    set_up_size=69,
    drive=112,
    present=126,
    present_size=_PRESENT_2.size,
    most_speed=0x7FFF,
    position_mode=3,
    alarm_shift=HARDWARE_ERRORS,
)


def signed(register: int, sign: int = CLOCKWISE_BIT) -> int:
    """Return the value of a register with a sign bit, positive for rising ticks."""
    value = register & (sign - 1)
    return -value if register & sign else value
