"""The registers that `setup` shows and writes, by name, and the coding of bit rates.

Addresses by ROBOTIS' e-manual of RX-24F, AX-12A, MX-28 (Protocol 1.0) and XL430-W250 (2.0), for
the STS3215 by Feetech's SCServo library (SMS_STS.h).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from nodlidar_servo.bus.packets import PacketFormat, PROTOCOL_1, PROTOCOL_2, PROTOCOL_STS
from nodlidar_servo.models.control_table import ControlTable, TABLE_1, TABLE_2
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.models.sts_table import TABLE_STS

_REGISTERS_1 = {
    'model number': (0, 2), 'firmware': (2, 1), 'ID': (3, 1), 'bit rate': (4, 1),
    'return delay': (5, 1), 'lower limit': (6, 2), 'upper limit': (8, 2),
    'hottest': (11, 1), 'lowest voltage': (12, 1), 'highest voltage': (13, 1),
    'return level': (16, 1), 'torque': (24, 1), 'position': (36, 2), 'voltage': (42, 1),
    'temperature': (43, 1), 'lock': (47, 1),
}  # fmt: skip
_REGISTERS_2 = {
    'model number': (0, 2), 'firmware': (6, 1), 'ID': (7, 1), 'bit rate': (8, 1),
    'return delay': (9, 1), 'drive mode': (10, 1), 'operating mode': (11, 1),
    'hottest': (31, 1), 'highest voltage': (32, 2), 'lowest voltage': (34, 2),
    'upper limit': (48, 4), 'lower limit': (52, 4), 'torque': (64, 1), 'return level': (68, 1),
    'errors': (70, 1), 'position': (132, 4), 'voltage': (144, 2), 'temperature': (146, 1),
}  # fmt: skip
_REGISTERS_STS = {
    'firmware': (0, 1), 'model number': (3, 2), 'ID': (5, 1), 'bit rate': (6, 1),
    'return delay': (7, 1), 'return level': (8, 1), 'lower limit': (9, 2), 'upper limit': (11, 2),
    'hottest': (13, 1), 'highest voltage': (14, 1), 'lowest voltage': (15, 1),
    'operating mode': (33, 1), 'torque': (40, 1), 'EEPROM lock': (55, 1), 'position': (56, 2),
    'voltage': (62, 1), 'temperature': (63, 1),
}  # fmt: skip
_CODES_STS = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
_CODES_2 = (9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
_FAST_CODES_1 = {250: 2_250_000, 251: 2_500_000, 252: 3_000_000}  # of an MX-28


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """Where the registers of a protocol are.

    Attributes
    ----------
    places
        First address and size by name.
    table
        What the node knows of them.
    position_mode
        Operating mode of position control; None if the protocol has no such register.
    """

    places: Mapping[str, tuple[int, int]]
    table: ControlTable
    position_mode: int | None = None

    @property
    def size(self) -> int:
        """Bytes from address 0 to the last of these registers."""
        return max(address + size for address, size in self.places.values())

    def values(self, data: bytes) -> dict[str, int]:
        """Return the values by name, of the bytes from address 0 on."""
        return {
            name: int.from_bytes(data[address : address + size], 'little', signed=size == 4)
            for name, (address, size) in self.places.items()
        }

    def encode(self, name: str, value: int) -> bytes:
        """Return a register's bytes."""
        return value.to_bytes(self.places[name][1], 'little')


_MAPS = {
    PROTOCOL_1: RegisterMap(_REGISTERS_1, TABLE_1),
    PROTOCOL_2: RegisterMap(_REGISTERS_2, TABLE_2, position_mode=3),
    PROTOCOL_STS: RegisterMap(_REGISTERS_STS, TABLE_STS, position_mode=0),
}
HEAD = 5  # bytes from address 0 on, which tell STS servos from those of Protocol 1.0


def registers_of(packets: PacketFormat) -> RegisterMap:
    """Return the registers of a protocol."""
    return _MAPS[packets]


def protocol_of(packets: PacketFormat, head: bytes) -> PacketFormat:
    """Return the protocol of a servo whose registers begin with HEAD bytes.

    STS servos answer to Protocol 1.0, with the model number elsewhere.
    """
    if packets is not PROTOCOL_1:
        return packets
    for own in (PROTOCOL_1, PROTOCOL_STS):
        number = registers_of(own).values(head.ljust(registers_of(own).size, b'\0'))[
            'model number'
        ]
        if any(m.number == number and m.table.packets is own for m in MODELS.values()):
            return own
    return packets


def rate_code(packets: PacketFormat, rate: int) -> int | None:
    """Return the register of a bit rate [bit/s] within 3 %, None if no servo has it."""
    codes = _rate_codes(packets)
    code = min(codes, key=lambda n: abs(codes[n] - rate))
    return code if abs(codes[code] / rate - 1.0) < 0.03 else None


def rate_of(packets: PacketFormat, code: int) -> int:
    """Return the bit rate [bit/s] of a register that :func:`rate_code` returned."""
    return round(_rate_codes(packets)[code])


def _rate_codes(packets: PacketFormat) -> Mapping[int, float]:
    if packets is not PROTOCOL_1:
        return dict(enumerate(_CODES_2 if packets is PROTOCOL_2 else _CODES_STS))
    return {n: 2_000_000 / (n + 1) for n in range(250)} | _FAST_CODES_1
