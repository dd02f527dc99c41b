"""The interface of an emulated serial device: bytes in, bytes out, at given times.

A device has no clock, no thread and no file. Each call passes the host time [ns], which never
decreases; `receive` and `transmit` first advance the device to that time.
"""

from typing import Protocol, runtime_checkable


class Device(Protocol):
    """A serial device as its host sees it."""

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes that the host sent at host time `now_ns`."""

    def transmit(self, now_ns: int) -> bytes:
        """Remove and return the bytes that have reached the host by `now_ns`."""

    def next_event_ns(self) -> int | None:
        """Return when to call `transmit` next [ns], None if no event is pending.

        After ``transmit(now_ns)``, that is later than `now_ns`.
        """


@runtime_checkable
class ChecksBitRate(Protocol):
    """A device that checks the bit rate of its host's port [bit/s], None if unknown."""

    host_bit_rate: int | None


class SilentDevice:
    """A device without power, or without bytes: it takes what comes, and never answers."""

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes."""

    def transmit(self, now_ns: int) -> bytes:
        """Return nothing."""
        return b''

    def next_event_ns(self) -> int | None:
        """Return that nothing is pending."""
        return None
