"""The lidar's 24-bit millisecond timer without its wraps (every 4 h 39 min 37.216 s)."""

from nodlidar_common.scip import TIMER_BITS

_WRAP_MS = 1 << TIMER_BITS
_AHEAD_MS = 1_000.0  # a timer that gained this much on the host's clock did not count: it jumped


class Timer:
    """Makes the timer's values ascend for ever; ``jumps`` counts where a clock was set.

    A timer that was reset looks like one that advanced by hours while the host's clock did not,
    and a host clock that was set back looks like a timer that gained on it. A host clock that was
    set forward cannot be told here from a host that was busy.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._last: tuple[int, int] | None = None
        self._value_ms = 0

    def unwrap(self, device_ms: int, arrival_ns: int) -> int:
        """Return the timer's value without wraps [ms]; the first one is what it was.

        Parameters
        ----------
        device_ms
            What the device sent [ms], 0 <= device_ms < 2**24.
        arrival_ns
            When it arrived [ns].
        """
        if self._last is None:
            self._value_ms = device_ms
        else:
            advance_ms = (device_ms - self._last[0]) % _WRAP_MS
            elapsed_ms = (arrival_ns - self._last[1]) / 1e6
            self.jumps += advance_ms > elapsed_ms + _AHEAD_MS
            self._value_ms += advance_ms
        self._last = (device_ms, arrival_ns)
        return self._value_ms
