"""The host's clock, which can be set, told by the steady clock, which cannot."""

from collections.abc import Callable
import math
import time

# A smaller step [ns] cannot be told from the time between two readings.
_LEAST_NS = 1_000_000
_DRIFT = 1e-3  # twice the rate that NTP corrects a clock by
# Two clocks are read at once if hardly any time passed meanwhile [ns]; a busy host interrupts.
_AT_ONCE_NS, _QUICK_NS, _ATTEMPTS = 300_000, 50_000, 5


class HostTime:
    """Tells the host's time by the steady clock; when it is set counts from the next look on.

    Parameters
    ----------
    clock, steady
        Return the time of the host's clock and of the steady clock [ns].

    Attributes
    ----------
    ahead_ns
        By how much the host's clock was ahead of the steady clock at the last look [ns].
    steps
        How often it was seen to be set.
    last_step_ns
        By how much it was last [ns].
    """

    def __init__(
        self,
        clock: Callable[[], int] = time.time_ns,
        steady: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.steps, self.last_step_ns = 0, 0
        self._clock, self._steady = clock, steady
        took_ns, self.ahead_ns, now_ns = self._reading()
        self._looked_ns = now_ns if took_ns <= _AT_ONCE_NS else -math.inf

    def __call__(self) -> int:
        """Return the host's time [ns]."""
        return self._steady() + self.ahead_ns

    def look(self) -> int:
        """Follow the host's clock; return by how much it was set [ns], 0 if it was not."""
        took_ns, ahead_ns, now_ns = self._reading()
        if took_ns > _AT_ONCE_NS:
            return 0
        step_ns, elapsed_ns = ahead_ns - self.ahead_ns, now_ns - self._looked_ns
        self.ahead_ns, self._looked_ns = ahead_ns, now_ns
        if abs(step_ns) <= _LEAST_NS + _DRIFT * elapsed_ns:
            return 0
        self.steps += 1
        self.last_step_ns = step_ns
        return step_ns

    def _reading(self) -> tuple[int, int, int]:
        """Return how long reading both took, by how much the host's is ahead, and when [ns]."""
        readings = []
        for _ in range(_ATTEMPTS):
            before_ns, clock_ns, after_ns = self._steady(), self._clock(), self._steady()
            ahead_ns = clock_ns - (before_ns + after_ns) // 2
            readings.append((after_ns - before_ns, ahead_ns, after_ns))
            if after_ns - before_ns <= _QUICK_NS:
                break
        return min(readings)
