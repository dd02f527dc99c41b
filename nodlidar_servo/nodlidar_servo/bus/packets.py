"""Packets of the servos' protocols, as the packet handlers of the Dynamixel SDK take them.

1.0: FF FF ID LENGTH INSTRUCTION parameters CHECKSUM; an answer has its status in place of the
instruction. 2.0: FF FF FD 00 ID LENGTH INSTRUCTION parameters CRC; an answer has the instruction
55 and its status before the parameters. Addresses and lengths have one byte or two (ROBOTIS
e-manual, protocols 1.0 and 2.0). Feetech's STS servos have the packets of 1.0, with a status of
their own (the SDK's handler of 1.0 and Feetech's SDK differ in nothing else).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from nodlidar_servo.bus.replies import REFUSALS, status_names, STS_ERRORS

_RESULTS = {
    1: 'result fail', 2: 'instruction', 3: 'CRC', 4: 'data range', 5: 'data length',
    6: 'data limit', 7: 'access',
}  # fmt: skip
_ALERT = 0x80
_STATUS_2 = 0x55  # instruction of an answer


@dataclass(frozen=True, slots=True)
class Answer:
    """The parts of an answer: ID of the servo, status byte, data."""

    servo_id: int
    status: int
    data: bytes


@dataclass(frozen=True)
class PacketFormat:
    """One version of the protocol.

    Attributes
    ----------
    version
        1.0 or 2.0.
    request_overhead, answer_overhead
        Bytes of a request and of an answer besides their parameters.
    number_size
        Bytes of an address or a length.
    """

    version: float
    request_overhead: int
    answer_overhead: int
    number_size: int

    @cached_property
    def handler(self) -> Any:
        """The packet handler of the SDK."""
        # Imported here, so that the launch files know the models without the SDK.
        from dynamixel_sdk import PacketHandler

        return PacketHandler(self.version)

    def number(self, value: int) -> bytes:
        """Return an address or a length as bytes."""
        return value.to_bytes(self.number_size, 'little')

    def request(self, servo_id: int, instruction: int, parameters: bytes) -> list[int]:
        """Return a request without its checksum, which the SDK adds."""
        raise NotImplementedError

    def answer(self, packet: Sequence[int]) -> Answer:
        """Return the parts of an answer whose checksum is right."""
        raise NotImplementedError

    def refusal(self, status: int) -> str:
        """Return why a status byte says that a request was refused, empty if it does not."""
        raise NotImplementedError

    def has_alarm(self, status: int) -> bool:
        """Return whether a status byte says that there is an alarm to be read from a register."""
        raise NotImplementedError

    def alarms(self, status: int) -> int:
        """Return the motor's state in a status byte, as bits of `replies.STATUS_BITS`."""
        return status

    def sealed(self, packet: bytes) -> bytes:
        """Return a packet with the right checksum or CRC in the place of its own."""
        raise NotImplementedError

    def encode(self, servo_id: int, instruction: int, parameters: bytes) -> bytes:
        """Return the bytes of a request; parameters of 2.0 must not contain FF FF FD."""
        return self.sealed(bytes(self.request(servo_id, instruction, parameters)))

    def encode_answer(self, servo_id: int, status: int) -> bytes:
        """Return the bytes of an answer without data."""
        raise NotImplementedError


class _Format1(PacketFormat):
    def request(self, servo_id: int, instruction: int, parameters: bytes) -> list[int]:
        return [0xFF, 0xFF, servo_id, len(parameters) + 2, instruction, *parameters, 0]

    def answer(self, packet: Sequence[int]) -> Answer:
        return Answer(packet[2], packet[4], bytes(packet[5 : 3 + packet[3]]))

    def refusal(self, status: int) -> str:
        return status_names(status) if status & REFUSALS else ''

    def has_alarm(self, status: int) -> bool:
        return False  # the status byte has it

    def sealed(self, packet: bytes) -> bytes:
        return packet[:-1] + bytes([~sum(packet[2:-1]) & 0xFF])

    def encode_answer(self, servo_id: int, status: int) -> bytes:
        return self.encode(servo_id, status, b'')


class _FormatSts(_Format1):
    """A servo that cannot do what it is asked for ignores it: every status is the motor's."""

    def refusal(self, status: int) -> str:
        return ''

    def alarms(self, status: int) -> int:
        return status << STS_ERRORS


class _Format2(PacketFormat):
    def request(self, servo_id: int, instruction: int, parameters: bytes) -> list[int]:
        length = (len(parameters) + 3).to_bytes(2, 'little')
        return [0xFF, 0xFF, 0xFD, 0, servo_id, *length, instruction, *parameters, 0, 0]

    def answer(self, packet: Sequence[int]) -> Answer:
        length = packet[5] + 256 * packet[6]
        return Answer(packet[4], packet[8], bytes(packet[9 : 5 + length]))

    def refusal(self, status: int) -> str:
        number = status & ~_ALERT
        return _RESULTS.get(number, f'error {number}') if number else ''

    def has_alarm(self, status: int) -> bool:
        return bool(status & _ALERT)

    def sealed(self, packet: bytes) -> bytes:
        crc = int(self.handler.updateCRC(0, packet, len(packet) - 2))
        return packet[:-2] + crc.to_bytes(2, 'little')

    def encode_answer(self, servo_id: int, status: int) -> bytes:
        return self.encode(servo_id, _STATUS_2, bytes([status]))


PROTOCOL_1 = _Format1(1.0, request_overhead=6, answer_overhead=6, number_size=1)
PROTOCOL_STS = _FormatSts(1.0, request_overhead=6, answer_overhead=6, number_size=1)
PROTOCOL_2 = _Format2(2.0, request_overhead=10, answer_overhead=11, number_size=2)
