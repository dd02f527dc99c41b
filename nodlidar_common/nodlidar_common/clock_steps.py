"""Steps of the host's clock, told from its rate by the steady clock."""

_LEAST_NS = 1_000_000  # a smaller step cannot be told from the time between two readings
_DRIFT = 1e-3  # twice the rate that NTP corrects a clock by


class ClockSteps:
    """Finds out by how much the host's clock was set, as often as it is asked."""

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None

    def step_ns(self, clock_ns: int, steady_ns: int) -> int:
        """Return by how much the clock was set since it was last asked [ns], forward positive.

        Parameters
        ----------
        clock_ns, steady_ns
            What the host's clock and the steady clock show, read at once [ns].
        """
        last, self._last = self._last, (clock_ns, steady_ns)
        if last is None:
            return 0
        elapsed_ns = steady_ns - last[1]
        step_ns = clock_ns - last[0] - elapsed_ns
        return step_ns if abs(step_ns) > _LEAST_NS + _DRIFT * elapsed_ns else 0
