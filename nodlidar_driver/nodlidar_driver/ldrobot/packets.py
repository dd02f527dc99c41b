"""Finds packets in a stream of bytes."""

from typing import NamedTuple

from nodlidar_common.ldrobot import checksums, HEADER, PACKET
import numpy as np
from numpy.typing import NDArray

_SIZE = PACKET.itemsize
_HEADER = np.frombuffer(HEADER, np.uint8)


class Taken(NamedTuple):
    """Packets, shape (n,) of :data:`.PACKET`, and the number of bytes that were none."""

    packets: NDArray[np.void]
    useless: int


def take_packets(buffer: bytearray) -> Taken:
    """Remove all whole packets from a buffer, and what cannot begin one."""
    found, useless = [np.empty((0, _SIZE), np.uint8)], 0
    while len(buffer) >= _SIZE:
        whole = len(buffer) // _SIZE * _SIZE
        rows = np.frombuffer(bytes(buffer[:whole]), np.uint8).reshape(-1, _SIZE)
        good = np.all(rows[:, : len(HEADER)] == _HEADER, axis=1) & (checksums(rows) == rows[:, -1])
        run = len(rows) if good.all() else int(good.argmin())
        found.append(rows[:run])
        del buffer[: run * _SIZE]
        if run < len(rows):
            skipped = _to_next_header(buffer)
            useless += skipped
            del buffer[:skipped]
    return Taken(np.concatenate(found).view(PACKET)[:, 0], useless)


def _to_next_header(buffer: bytearray) -> int:
    """Return how many bytes are before the next header, or its first byte, but for the first."""
    found = buffer.find(HEADER, 1)
    if found >= 0:
        return found
    return len(buffer) - buffer.endswith(HEADER[:1])
