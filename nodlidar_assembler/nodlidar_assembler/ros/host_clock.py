"""The clocks of the node: steps of the host's clock, and the clock of deadlines."""

from collections.abc import Callable

from nodlidar_common.host_time import HostTime
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.steady import steady_ns
from rclpy.node import Node

# Messages within this time [ns] after a step may still be stamped by the former time.
SETTLING_NS = NS_PER_S // 2


class HostClock:
    """Detects steps of the clock by which messages are stamped.

    Parameters
    ----------
    node
        Owner of the clock; a simulated clock is not checked.
    on_step
        Called with the step [ns] after the clock was set.
    """

    def __init__(self, node: Node, on_step: Callable[[int], None]) -> None:
        self._clock, self._on_step = node.get_clock(), on_step
        self._time = HostTime(self.now_ns, steady_ns)
        self._settled_ns = 0

    def now_ns(self) -> int:
        """Return the time by which messages are stamped [ns]."""
        return int(self._clock.now().nanoseconds)

    def patience_ns(self) -> int:
        """Return the time for deadlines [ns]: steady, or simulated like the stamps."""
        return self.now_ns() if self._clock.ros_time_is_active else steady_ns()

    def check(self) -> bool:
        """Check for a step of the clock; return whether stamps are of the present time."""
        if self._clock.ros_time_is_active:
            return True
        if step_ns := self._time.update():
            self._settled_ns = steady_ns() + SETTLING_NS
            self._on_step(step_ns)
        return steady_ns() >= self._settled_ns
