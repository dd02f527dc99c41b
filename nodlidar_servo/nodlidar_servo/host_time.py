"""The host's clock as one cycle needs it: without jumps between a request and its reply."""

from collections.abc import Callable
import time

from nodlidar_common.steady import steady_ns

STEP_NS = 1_000_000
"""From this change [ns] on the host's clock counts as set, not as corrected."""

# Two clocks are read at once if no more time passed meanwhile [ns]; a busy host interrupts.
_AT_ONCE_NS, _ATTEMPTS = 50_000, 5


class HostTime:
    """Tells the host's time by the steady clock; when it is set counts from :meth:`follow` on.

    Parameters
    ----------
    host, steady
        Return the time of the host's clock and of the steady clock [ns].
    """

    def __init__(
        self,
        host: Callable[[], int] = time.time_ns,
        steady: Callable[[], int] = steady_ns,
    ) -> None:
        self._host, self._steady = host, steady
        self._offset_ns = host() - steady()
        self.follow()

    def __call__(self) -> int:
        """Return the host's time [ns]."""
        return self._steady() + self._offset_ns

    def follow(self) -> int:
        """Follow the host's clock; return by how much it was set [ns], 0 if it was not."""
        for _ in range(_ATTEMPTS):
            before_ns, host_ns, after_ns = self._steady(), self._host(), self._steady()
            if after_ns - before_ns <= _AT_ONCE_NS:
                former_ns, self._offset_ns = self._offset_ns, host_ns - before_ns
                change_ns = self._offset_ns - former_ns
                return change_ns if abs(change_ns) >= STEP_NS else 0
        return 0
