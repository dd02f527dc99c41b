"""What an emulated serial device is: bytes in, bytes out, at given times.

A device has no clock, no thread and no file of its own. Host time [ns] comes with every call and
never goes backwards; `receive` and `transmit` first bring the device up to that time.
"""

from typing import Protocol, runtime_checkable


class Device(Protocol):
    """A serial device as its host sees it."""

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes that the host sent at host time `now_ns`."""

    def transmit(self, now_ns: int) -> bytes:
        """Return, once, the bytes that have reached the host by `now_ns`."""

    def next_event_ns(self) -> int | None:
        """Return when `transmit` should next be called, or None if nothing is coming up.

        After ``transmit(now_ns)`` it is later than `now_ns`.
        """


@runtime_checkable
class HearsBitRate(Protocol):
    """A device that is told the bit rate of its host's port [bit/s], None where it is unknown."""

    host_bit_rate: int | None
