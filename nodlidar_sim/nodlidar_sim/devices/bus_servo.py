"""What all servos on a bus do with bytes: they take time, and other bit rates are noise."""

from collections.abc import Iterator
import math
from typing import Protocol

from nodlidar_sim.devices.dynamixel_packets import Instruction
from nodlidar_sim.devices.wire import BITS_PER_BYTE, Wire

_PIECE = 256
_BIT_RATE_TOLERANCE = 0.03


class Reader(Protocol):
    """Finds instruction packets in a stream."""

    def feed(self, data: bytes, now_ns: int) -> Iterator[tuple[Instruction, int]]:
        """Yield each packet that the data complete, with the number of bytes used so far."""


class BusServo:
    """A servo, its bus and its USB adapter as the host sees them; a `Device`.

    Parameters
    ----------
    reader
        Of its protocol.
    bit_rate
        At power-up [bit/s].
    latency_timer
        Of the USB adapter, which delivers replies at multiples of it [s]; 0 for at once.

    Attributes
    ----------
    host_bit_rate
        Bit rate of the host's port [bit/s], None if unknown. The servo ignores other rates than
        its own.
    """

    def __init__(self, reader: Reader, bit_rate: float, latency_timer: float) -> None:
        self.host_bit_rate: int | None = None
        self._reader = reader
        self._wire = Wire(bit_rate / BITS_PER_BYTE, _PIECE, round(latency_timer * 1e9))
        self._received_ns = 0

    @property
    def bit_rate(self) -> float:
        """Bit rate of the servo [bit/s]."""
        raise NotImplementedError

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the host, which take time on the wire as of the bit rate."""
        if not self._bit_rates_match():
            return
        start_ns = max(now_ns, self._received_ns)
        for instruction, taken in self._reader.feed(data, now_ns):
            self._handle(instruction, start_ns + self._wire.duration_ns(taken))
        self._received_ns = start_ns + self._wire.duration_ns(len(data))
        self._wire.bytes_per_second = self.bit_rate / BITS_PER_BYTE

    def transmit(self, now_ns: int) -> bytes:
        """Remove and return the bytes that have reached the host by a time [ns]."""
        return self._wire.take(now_ns)

    def next_event_ns(self) -> int | None:
        """Return when the next reply reaches the host [ns], None if none is on its way."""
        return self._wire.next_event_ns()

    def _bit_rates_match(self) -> bool:
        if self.host_bit_rate is None:
            return True
        return math.isclose(self.host_bit_rate, self.bit_rate, rel_tol=_BIT_RATE_TOLERANCE)

    def _handle(self, instruction: Instruction, at_ns: int) -> None:
        """Execute a packet at the time at which it was complete, and answer it."""
        raise NotImplementedError


def data_for(servo_id: int, servos: bytes, size: int) -> bytes | None:
    """Return a servo's part of a synchronous write, None if it has none.

    Parameters
    ----------
    servo_id
        Of the servo.
    servos
        ID and data of each servo, one after the other.
    size
        Of the data of each [bytes].
    """
    for begin in range(0, len(servos) - size, size + 1):
        if servos[begin] == servo_id:
            return servos[begin + 1 : begin + 1 + size]
    return None
