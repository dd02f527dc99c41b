"""Several servos on one bus: replies that overlap in time break each other.

The line idles high, and a servo that sends a 0 wins over one that sends a 1: so it is with TTL.
Bytes are aligned to the nearest one. Replies that overlap are delivered when the last one ends.
Delays of a USB adapter are not emulated.
"""

from collections.abc import Sequence

from nodlidar_sim.devices.bus_servo import BusServo


class SharedBus:
    """Servos on one bus, a `Device`; each byte of a reply arrives at its own time.

    Parameters
    ----------
    servos
        The servos.
    """

    def __init__(self, servos: Sequence[BusServo]) -> None:
        self._servos = servos
        self._due: list[tuple[int, int, bytes]] = []  # begin, end, data

    @property
    def host_bit_rate(self) -> int | None:
        """Bit rate of the host's port [bit/s], None if unknown."""
        return self._servos[0].host_bit_rate

    @host_bit_rate.setter
    def host_bit_rate(self, rate: int | None) -> None:
        for servo in self._servos:
            servo.host_bit_rate = rate

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the host; replies are collected with their times."""
        for servo in self._servos:
            servo.receive(data, now_ns)
            self._collect(servo)
        self._due = _collided(self._due)

    def _collect(self, servo: BusServo) -> None:
        while (end := servo.next_event_ns()) is not None:
            reply = servo.transmit(end)
            duration = round(len(reply) * 10e9 / servo.bit_rate)
            self._due.append((end - duration, end, reply))

    def transmit(self, now_ns: int) -> bytes:
        """Remove and return the bytes that have reached the host by a time [ns]."""
        arrived = [reply for _, end, reply in self._due if end <= now_ns]
        self._due = [each for each in self._due if each[1] > now_ns]
        return b''.join(arrived)

    def next_event_ns(self) -> int | None:
        """Return when the next reply reaches the host [ns], None if none is on its way."""
        return min((end for _, end, _ in self._due), default=None)


def _collided(replies: list[tuple[int, int, bytes]]) -> list[tuple[int, int, bytes]]:
    """Return the replies in the order of time, those that overlap as one."""
    merged: list[tuple[int, int, bytes]] = []
    for begin, end, data in sorted(replies):
        if merged and begin < merged[-1][1]:
            first, last, other = merged[-1]
            merged[-1] = first, max(last, end), _overlaid(other, data, begin - first, end - begin)
        else:
            merged.append((begin, end, data))
    return merged


def _overlaid(first: bytes, second: bytes, late_ns: int, duration_ns: int) -> bytes:
    """Return what the host receives of two replies, the second one late by a time [ns]."""
    per_byte = duration_ns / len(second)
    shift = round(late_ns / per_byte)
    size = max(len(first), shift + len(second))
    padded = first.ljust(size, b'\xff')
    other = (b'\xff' * shift + second).ljust(size, b'\xff')
    return bytes(a & b for a, b in zip(padded, other, strict=True))
