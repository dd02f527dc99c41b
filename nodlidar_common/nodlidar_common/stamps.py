"""Times as nanoseconds, and those of messages: of rclpy, or of a bag read without ROS."""

from typing import Protocol

NS_PER_S = 1_000_000_000
# Latest accepted time [ns]: one day before the end of what messages can hold, in 2038.
LATEST_NS = (2**31 - 86_400) * NS_PER_S


class Stamp(Protocol):
    """A builtin_interfaces/Time."""

    @property
    def sec(self) -> int:
        """Whole seconds."""

    @property
    def nanosec(self) -> int:
        """Nanoseconds, 0 .. 999 999 999."""


def time_ns(stamp: Stamp) -> int:
    """Return a message's time as nanoseconds."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)
