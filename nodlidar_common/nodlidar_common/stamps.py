"""Times of messages, whoever read them: rclpy's, or a bag's without ROS."""

from typing import Protocol

from nodlidar_common.nod import NS_PER_S

# The last instant [ns] that counts as one: with a day to go until messages, in 2038, hold no more.
LATEST_NS = (2**31 - 86_400) * NS_PER_S


class Stamp(Protocol):
    """A builtin_interfaces/Time."""

    @property
    def sec(self) -> int:
        """Whole seconds."""

    @property
    def nanosec(self) -> int:
        """Nanoseconds beyond them, 0 .. 999 999 999."""


def time_ns(stamp: Stamp) -> int:
    """Return a message's time as nanoseconds."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)
