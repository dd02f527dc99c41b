"""The line from a device to its host, with its speed and latency."""

from collections import deque

BITS_PER_BYTE = 10
"""On a serial line: 8 data bits, a start bit and a stop bit."""


class Wire:
    """Carries bytes one after the other and delivers them in pieces.

    Parameters
    ----------
    bytes_per_second
        Speed.
    piece
        Most bytes in a piece, which is delivered when its last byte has arrived.
    latency_ns
        Latency timer of a USB adapter: pieces are delivered at multiples of it [ns].
    """

    def __init__(self, bytes_per_second: float, piece: int, latency_ns: int = 0) -> None:
        self.bytes_per_second = bytes_per_second
        self._piece = piece
        self._latency_ns = latency_ns
        self._pieces: deque[tuple[int, bytes]] = deque()
        self._free_ns = 0

    def duration_ns(self, size: int) -> int:
        """Return how long a number of bytes takes [ns]."""
        return round(size * 1e9 / self.bytes_per_second)

    def send(self, data: bytes, now_ns: int) -> None:
        """Send bytes from a time [ns] on, after those already on their way."""
        start_ns = max(now_ns, self._free_ns)
        for begin in range(0, len(data), self._piece):
            piece = data[begin : begin + self._piece]
            self._free_ns = start_ns + self.duration_ns(begin + len(piece))
            self._pieces.append((self._delivered_ns(self._free_ns), piece))

    def take(self, now_ns: int) -> bytes:
        """Remove and return the bytes delivered by a time [ns]."""
        arrived = b''
        while self._pieces and self._pieces[0][0] <= now_ns:
            arrived += self._pieces.popleft()[1]
        return arrived

    def next_event_ns(self) -> int | None:
        """Return when the next piece is delivered [ns], None if none is on its way."""
        return self._pieces[0][0] if self._pieces else None

    def _delivered_ns(self, arrival_ns: int) -> int:
        if not self._latency_ns:
            return arrival_ns
        return -(-arrival_ns // self._latency_ns) * self._latency_ns
