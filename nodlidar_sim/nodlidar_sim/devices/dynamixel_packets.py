"""Packets of Dynamixel Protocol 1.0, as a servo reads and writes them.

FF FF ID LENGTH INSTRUCTION parameters CHECKSUM, where LENGTH counts the bytes after it. A status
packet has the error bits in place of the instruction.
"""

from collections.abc import Iterator
from dataclasses import dataclass

BROADCAST = 0xFE

_HEADER = b'\xff\xff'
_OVERHEAD = 4  # header, id, length
_GAP_NS = 100_000_000


@dataclass(frozen=True, slots=True)
class Instruction:
    """An instruction packet.

    Attributes
    ----------
    servo_id, code, parameters
        As sent; the parameters are empty if the checksum is wrong.
    sound
        Whether the checksum is right.
    """

    servo_id: int
    code: int
    parameters: bytes
    sound: bool


def checksum(body: bytes) -> int:
    """Return the checksum of the bytes between header and checksum."""
    return ~sum(body) & 0xFF


def status_packet(servo_id: int, errors: int, data: bytes = b'') -> bytes:
    """Return a servo's answer."""
    body = bytes((servo_id, len(data) + 2, errors)) + data
    return _HEADER + body + bytes((checksum(body),))


class InstructionReader:
    """Finds instruction packets in a stream that may contain other bytes."""

    def __init__(self) -> None:
        self._buffer = b''
        self._last_ns = 0

    def feed(self, data: bytes, now_ns: int) -> Iterator[tuple[Instruction, int]]:
        """Yield each packet that the data complete, with the number of bytes of data used so far.

        As by the servo, a packet is dropped after a pause of more than 100 ms.
        """
        if now_ns - self._last_ns > _GAP_NS:
            self._buffer = b''
        self._last_ns = now_ns
        self._buffer += data
        while (instruction := self._next()) is not None:
            yield instruction, len(data) - len(self._buffer)

    def _next(self) -> Instruction | None:
        self._find_header()
        if len(self._buffer) < _OVERHEAD:
            return None
        size = _OVERHEAD + self._buffer[3]
        if len(self._buffer) < size:
            return None
        packet, self._buffer = self._buffer[:size], self._buffer[size:]
        return _parse(packet)

    def _find_header(self) -> None:
        """Drop bytes until the buffer may be the beginning of a packet."""
        while self._buffer and not _may_begin(self._buffer):
            after = self._buffer.find(_HEADER, 1)
            keep_one = self._buffer.endswith(b'\xff') and len(self._buffer) > 1
            self._buffer = self._buffer[after:] if after > 0 else b'\xff' * keep_one


def _may_begin(data: bytes) -> bool:
    """Return whether data begin like a packet: header, ID below FF, length of at least 2."""
    return (
        _HEADER.startswith(data[:2])
        and (len(data) < 3 or data[2] != 0xFF)
        and (len(data) < 4 or data[3] >= 2)
    )


def _parse(packet: bytes) -> Instruction:
    sound = packet[-1] == checksum(packet[2:-1])
    return Instruction(packet[2], packet[4], packet[5:-1] if sound else b'', sound)
