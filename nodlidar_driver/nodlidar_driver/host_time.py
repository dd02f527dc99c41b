"""From the steady clock, by which the driver works, to the host's clock, which can be set."""

from collections.abc import Callable

from nodlidar_common.clock_steps import ClockSteps

# Two clocks are read at once if no more time passed meanwhile [ns]; a busy host interrupts.
_AT_ONCE_NS, _ATTEMPTS = 100_000, 5


class HostTime:
    """Tells times by the host's clock as it is set at present.

    Parameters
    ----------
    clock, steady
        Return the time of the host's clock and of the steady clock [ns].

    Attributes
    ----------
    steps
        How often the host's clock was seen to be set.
    last_step_ns
        By how much it was last [ns].
    """

    def __init__(self, clock: Callable[[], int], steady: Callable[[], int]) -> None:
        self.steps = 0
        self.last_step_ns = 0
        self._clock, self._steady = clock, steady
        self._watch = ClockSteps()

    def ahead_ns(self) -> int:
        """Return by how much the host's clock is ahead of the steady clock now [ns]."""
        _, clock_ns, steady_ns = min(self._readings())
        step_ns = self._watch.step_ns(clock_ns, steady_ns)
        if step_ns:
            self.steps += 1
            self.last_step_ns = step_ns
        return clock_ns - steady_ns

    def _readings(self) -> list[tuple[int, int, int]]:
        """Return readings of both clocks and how long each took, until one was quick [ns]."""
        readings = []
        for _ in range(_ATTEMPTS):
            before_ns, clock_ns, after_ns = self._steady(), self._clock(), self._steady()
            readings.append((after_ns - before_ns, clock_ns, (before_ns + after_ns) // 2))
            if after_ns - before_ns <= _AT_ONCE_NS:
                break
        return readings
