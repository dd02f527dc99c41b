"""The clocks of the node: what happens when the host's is set, and by which scans wait."""

from collections.abc import Callable

from nodlidar_common.host_time import HostTime
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.steady import steady_ns
from rclpy.node import Node

# What comes within this time [ns] after the clock was set may still be stamped by the former time.
SETTLING_NS = NS_PER_S // 2


class HostClock:
    """Watches the clock that messages are stamped by.

    Parameters
    ----------
    node
        Whose clock it is; a simulated one is not watched.
    on_step
        Called with the step [ns] when the clock was set.
    """

    def __init__(self, node: Node, on_step: Callable[[int], None]) -> None:
        self._clock, self._on_step = node.get_clock(), on_step
        self._time = HostTime(self.now_ns, steady_ns)
        self._settled_ns = 0

    def now_ns(self) -> int:
        """Return the time that messages are stamped by [ns]."""
        return int(self._clock.now().nanoseconds)

    def patience_ns(self) -> int:
        """Return the time by which scans wait [ns]: steady, or simulated as their stamps are."""
        return self.now_ns() if self._clock.ros_time_is_active else steady_ns()

    def check(self) -> bool:
        """Check whether the clock was set; return whether stamps are of the present time again."""
        if self._clock.ros_time_is_active:
            return True
        if step_ns := self._time.update():
            self._settled_ns = steady_ns() + SETTLING_NS
            self._on_step(step_ns)
        return steady_ns() >= self._settled_ns
