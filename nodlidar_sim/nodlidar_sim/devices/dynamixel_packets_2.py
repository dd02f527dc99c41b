"""Packets of Dynamixel Protocol 2.0, as a servo reads and writes them.

FF FF FD 00 ID LENGTH INSTRUCTION parameters CRC: length and CRC-16 have two bytes each. From the
instruction on, FD follows each FF FF FD (ROBOTIS e-manual, Protocol 2.0).
"""

from nodlidar_sim.devices import dynamixel_packets
from nodlidar_sim.devices.dynamixel_packets import Instruction

_HEADER, _STUFFED = b'\xff\xff\xfd', b'\xff\xff\xfd\xfd'
_STATUS = 0x55
_BEFORE_LENGTH, _OVERHEAD = 5, 7
_MOST = 1024  # bytes of a packet
_POLYNOMIAL = 0x8005


def crc16(data: bytes) -> int:
    """Return the CRC-16 with polynomial 8005, from 0 and without reflection (CRC-16/BUYPASS)."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (_POLYNOMIAL if crc & 0x8000 else 0)
            crc &= 0xFFFF
    return crc


def packet(servo_id: int, instruction: int, parameters: bytes = b'') -> bytes:
    """Return the bytes of a packet."""
    body = (bytes([instruction]) + parameters).replace(_HEADER, _STUFFED)
    head = _HEADER + bytes([0, servo_id]) + (len(body) + 2).to_bytes(2, 'little')
    return head + body + crc16(head + body).to_bytes(2, 'little')


def status_packet(servo_id: int, error: int, data: bytes = b'') -> bytes:
    """Return a servo's answer."""
    return packet(servo_id, _STATUS, bytes([error]) + data)


class InstructionReader(dynamixel_packets.InstructionReader):
    """Finds instruction packets in a stream that may contain other bytes."""

    def _next(self) -> Instruction | None:
        while not _may_begin(self._buffer):
            self._buffer = self._buffer[1:]
        if len(self._buffer) < _OVERHEAD:
            return None
        size = _OVERHEAD + _length(self._buffer)
        if len(self._buffer) < size:
            return None
        whole, self._buffer = self._buffer[:size], self._buffer[size:]
        return _parse(whole)


def _length(data: bytes) -> int:
    return int.from_bytes(data[_BEFORE_LENGTH:_OVERHEAD], 'little')


def _may_begin(data: bytes) -> bool:
    """Return whether data begin like a packet, or are too short to tell."""
    if not (_HEADER + b'\x00').startswith(data[:4]):
        return False
    return len(data) < _OVERHEAD or 3 <= _length(data) <= _MOST


def _parse(whole: bytes) -> Instruction:
    sound = int.from_bytes(whole[-2:], 'little') == crc16(whole[:-2])
    parameters = whole[8:-2].replace(_STUFFED, _HEADER) if sound else b''
    return Instruction(whole[4], whole[7], parameters, sound)
