"""The clocks of the node: what happens when the host's is set, and by which scans wait."""

from collections.abc import Callable

from nodlidar_common.clock_steps import ClockSteps
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.steady import steady_ns
from rclpy.node import Node

# What comes within this time [ns] after the clock was set may still be stamped by the former time.
SETTLING_NS = NS_PER_S // 2
# Two clocks are read at once if no more time passed meanwhile [ns]; a busy host interrupts.
_AT_ONCE_NS, _ATTEMPTS = 300_000, 5


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
        self._steps = ClockSteps()
        self._settled_ns = 0

    def now_ns(self) -> int:
        """Return the time that messages are stamped by [ns]."""
        return int(self._clock.now().nanoseconds)

    def patience_ns(self) -> int:
        """Return the time by which scans wait [ns]: steady, or simulated as their stamps are."""
        return self.now_ns() if self._clock.ros_time_is_active else steady_ns()

    def look(self) -> bool:
        """Look whether the clock was set; return whether stamps are of the present time again."""
        if self._clock.ros_time_is_active:
            return True
        for _ in range(_ATTEMPTS):
            before_ns, clock_ns, now_ns = steady_ns(), self.now_ns(), steady_ns()
            if now_ns - before_ns <= _AT_ONCE_NS:
                self._compare(clock_ns, now_ns)
                break
        return steady_ns() >= self._settled_ns

    def _compare(self, clock_ns: int, now_ns: int) -> None:
        step_ns = self._steps.step_ns(clock_ns, now_ns)
        if step_ns:
            self._settled_ns = now_ns + SETTLING_NS
            self._on_step(step_ns)
