"""The clocks of the node: steps of the host's clock, and the clock of deadlines."""

from collections.abc import Callable

from nodlidar_common.host_time import HostTime
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from rclpy.node import Node

# Messages within this time [ns] after a step may still be stamped by the former time.
SETTLING_NS = NS_PER_S // 2


class ClockWatch:
    """Detects steps of the clock by which messages are stamped.

    A step counts if the stamps make it, too: those of another machine do not.

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
        self._step_ns, self._stepped_ns, self._doubtful_until_ns = 0, 0, 0
        self._ages_ns: dict[type, int] = {}  # of the last messages before a step, by kind

    def now_ns(self) -> int:
        """Return the time by which messages are stamped [ns]."""
        return int(self._clock.now().nanoseconds)

    @property
    def is_simulated(self) -> bool:
        """Whether time is that of /clock."""
        return bool(self._clock.ros_time_is_active)

    def arrival_ns(self, received_ns: int) -> int:
        """Return when a message arrived, by the clock of the stamps [ns].

        Parameters
        ----------
        received_ns
            Time of its arrival by the host's clock [ns]; 0 if unknown: it arrives now.
        """
        return received_ns if received_ns and not self.is_simulated else self.now_ns()

    def deadline_clock_ns(self) -> int:
        """Return the time for deadlines [ns]: steady, or simulated like the stamps."""
        return self.now_ns() if self.is_simulated else steady_ns()

    def check(self, kind: type, stamp_ns: int, arrived_ns: int = 0) -> bool:
        """Check for a step of the clock; return whether a stamp is of the present time.

        Parameters
        ----------
        kind
            Type of the message, all of which are equally old on their arrival, more or less.
        stamp_ns
            Its stamp [ns].
        arrived_ns
            Time of its arrival by the host's clock [ns], if it has waited since; 0 if unknown.
        """
        if self.is_simulated:
            return True
        step_ns, now_ns = self._time.update(), self._time()
        if step_ns:
            self._step_ns += step_ns
            self._stepped_ns = now_ns
            self._doubtful_until_ns = steady_ns() + SETTLING_NS
        if self._step_ns and arrived_ns and not self._stepped_ns <= arrived_ns <= now_ns:
            return steady_ns() >= self._settled_ns  # it arrived before the step
        age_ns = (arrived_ns or now_ns) - stamp_ns
        if self._step_ns and self._decided(age_ns - self._ages_ns.get(kind, age_ns)):
            self._step_ns = 0
            self._ages_ns.clear()
        if not self._step_ns:
            self._ages_ns[kind] = age_ns
        return steady_ns() >= self._settled_ns

    def _decided(self, older_ns: int) -> bool:
        """Return whether it is known if the stamps make the step; call on_step if they do.

        Parameters
        ----------
        older_ns
            By how much a message is older on its arrival than one before the step [ns].
        """
        if abs(older_ns) < abs(self._step_ns) / 2:
            self._settled_ns = steady_ns() + SETTLING_NS
            self._on_step(self._step_ns)
            return True
        return steady_ns() >= self._doubtful_until_ns
