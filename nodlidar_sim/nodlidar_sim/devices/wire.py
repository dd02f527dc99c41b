"""The time that bytes take from a device to its host."""

from collections import deque

BITS_PER_BYTE = 10
"""On a serial line: 8 data bits, a start bit and a stop bit."""


class Wire:
    """Carries one byte after the other, and hands them over in pieces.

    Parameters
    ----------
    bytes_per_second
        Speed.
    piece
        Most bytes that are handed over at once, when the last of them has arrived.
    latency_ns
        Latency timer of a USB adapter, which hands over what arrived at multiples of it [ns].
    """

    def __init__(self, bytes_per_second: float, piece: int, latency_ns: int = 0) -> None:
        self.bytes_per_second = bytes_per_second
        self._piece = piece
        self._latency_ns = latency_ns
        self._pieces: deque[tuple[int, bytes]] = deque()
        self._free_ns = 0

    def busy(self, now_ns: int) -> bool:
        """Tell whether bytes are still on their way."""
        return now_ns < self._free_ns

    def duration_ns(self, size: int) -> int:
        """Return how long [ns] a number of bytes takes."""
        return round(size * 1e9 / self.bytes_per_second)

    def send(self, data: bytes, now_ns: int) -> None:
        """Send bytes from now [ns] on, or from when those before them are through."""
        start_ns = max(now_ns, self._free_ns)
        for begin in range(0, len(data), self._piece):
            piece = data[begin : begin + self._piece]
            self._free_ns = start_ns + self.duration_ns(begin + len(piece))
            self._pieces.append((self._handed_over_ns(self._free_ns), piece))

    def take(self, now_ns: int) -> bytes:
        """Return, once, what has arrived by now [ns]."""
        arrived = b''
        while self._pieces and self._pieces[0][0] <= now_ns:
            arrived += self._pieces.popleft()[1]
        return arrived

    def next_event_ns(self) -> int | None:
        """Return when [ns] the next piece arrives, or None if none is on its way."""
        return self._pieces[0][0] if self._pieces else None

    def _handed_over_ns(self, arrival_ns: int) -> int:
        if not self._latency_ns:
            return arrival_ns
        return -(-arrival_ns // self._latency_ns) * self._latency_ns
