"""The bytes that a serial port keeps for a host that has not read them yet."""

BUFFER_BYTES = 65536
"""Bytes kept for a host that does not read; about what a tty holds."""


class BoundedBuffer:
    """Bytes waiting for the host; when it is full the oldest go, and are counted.

    Attributes
    ----------
    dropped
        Bytes lost since the start.
    """

    def __init__(self, limit: int = BUFFER_BYTES) -> None:
        self.dropped = 0
        self._limit = limit
        self._data = bytearray()

    def __len__(self) -> int:
        return len(self._data)

    def append(self, data: bytes) -> None:
        """Add bytes at the end."""
        self._data += data
        excess = max(0, len(self._data) - self._limit)
        self.dropped += excess
        del self._data[:excess]

    def peek(self, size: int) -> bytes:
        """Return up to `size` of the oldest bytes, which stay."""
        return bytes(self._data[:size])

    def discard(self, size: int) -> None:
        """Remove the `size` oldest bytes."""
        del self._data[:size]

    def clear(self) -> None:
        """Remove all bytes."""
        self._data.clear()
