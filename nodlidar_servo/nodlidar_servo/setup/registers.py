"""The registers of a protocol, and the coding of bit rates.

By ROBOTIS' e-manual of RX-24F, AX-12A, MX-28 (Protocol 1.0) and XL430-W250 (2.0), for the STS3215
by Feetech's SCServo library (SMS_STS.h).
"""

from collections.abc import Mapping

from nodlidar_servo.bus.packets import PacketFormat, PROTOCOL_1, PROTOCOL_2, PROTOCOL_STS
from nodlidar_servo.models.control_table import ControlTable, TABLE_1, TABLE_2
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.models.sts_table import TABLE_STS

_CODES_STS = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
_CODES_2 = (9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
_FAST_CODES_1 = {250: 2_250_000, 251: 2_500_000, 252: 3_000_000}  # of an MX-28

_TABLES = {table.packets: table for table in (TABLE_1, TABLE_2, TABLE_STS)}
HEAD = 5  # bytes from address 0 on, which tell STS servos from those of Protocol 1.0


def registers_of(packets: PacketFormat) -> ControlTable:
    """Return the registers of a protocol."""
    return _TABLES[packets]


def protocol_of(packets: PacketFormat, head: bytes) -> PacketFormat:
    """Return the protocol of a servo whose registers begin with HEAD bytes.

    STS servos answer to Protocol 1.0, with the model number elsewhere.
    """
    if packets is not PROTOCOL_1:
        return packets
    for own in (PROTOCOL_1, PROTOCOL_STS):
        number = registers_of(own).values(head).get('model number')
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
