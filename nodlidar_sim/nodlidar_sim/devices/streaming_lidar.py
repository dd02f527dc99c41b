"""A lidar that sends without being asked and takes no commands: LD06, LD19, STL-27L.

As the LD19's manual has it: packets of 47 bytes, `54 2C` first, 375 a second at 4500 points/s.
The bytes after the header are noise here: a host that looks for another device reads none of them.
"""

import numpy as np

_HEADER = bytes([0x54, 0x2C])
_SIZE = 47
_PERIOD_NS = round(1e9 / 375)


class StreamingLidar:
    """An LD19, a `Device`, that is switched on when it is first asked for bytes."""

    def __init__(self) -> None:
        self._next_ns: int | None = None
        self._noise = np.random.default_rng(0)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Ignore what the host sends."""

    def transmit(self, now_ns: int) -> bytes:
        """Return the packets that have reached the host by a time [ns]."""
        due_ns = now_ns if self._next_ns is None else self._next_ns
        packets = []
        while due_ns <= now_ns:
            packets.append(_HEADER + self._noise.bytes(_SIZE - len(_HEADER)))
            due_ns += _PERIOD_NS
        self._next_ns = due_ns
        return b''.join(packets)

    def next_event_ns(self) -> int | None:
        """Return when the next packet reaches the host [ns]."""
        return self._next_ns
