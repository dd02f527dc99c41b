"""The bytes that a serial port keeps until its host reads them."""

BUFFER_BYTES = 65536
"""Limit of the bytes kept; about the size of a tty's buffer."""


class BoundedBuffer:
    """Bytes that wait for the host; when it is full, the oldest are dropped.

    Attributes
    ----------
    dropped
        Number of bytes dropped.
    """

    def __init__(self, limit: int = BUFFER_BYTES) -> None:
        self.dropped = 0
        self._limit = limit
        self._data = bytearray()

    def __len__(self) -> int:
        return len(self._data)

    def append(self, data: bytes) -> None:
        """Append bytes."""
        self._data += data
        excess = max(0, len(self._data) - self._limit)
        self.dropped += excess
        del self._data[:excess]

    def peek(self, size: int) -> bytes:
        """Return up to `size` of the oldest bytes without removing them."""
        return bytes(self._data[:size])

    def discard(self, size: int) -> None:
        """Remove the `size` oldest bytes."""
        del self._data[:size]

    def clear(self) -> None:
        """Remove all bytes."""
        self._data.clear()
