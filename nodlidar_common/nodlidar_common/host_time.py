"""The clocks of the host: the time, which can be set, the steady one and the raw one."""

from collections import deque
from collections.abc import Callable
import math
import time

from nodlidar_common.arrays import Times
import numpy as np

# A smaller step [ns] cannot be distinguished from the time between two readings.
_LEAST_NS = 1_000_000
_DRIFT = 1e-3  # twice the rate at which NTP corrects a clock
# Two clocks are read at once if no more time than this passes [ns]; a busy host interrupts.
_AT_ONCE_NS, _QUICK_NS, _ATTEMPTS = 300_000, 50_000, 5
_READINGS = 200  # of the steady clock: at ten per second, for twenty seconds


def raw_ns() -> int:
    """Return the time of the clock that is never slewed [ns]; only differences are meaningful.

    NTP corrects the steady clock, too: by up to 500 ppm, and chrony by up to 8 %. A device's clock
    runs evenly, as this one does.
    """
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW)


class HostTime:
    """Returns the host's time; a step of the host's clock takes effect at the next update.

    Parameters
    ----------
    clock, steady
        Return the time of the host's clock and of the steady clock [ns].

    Attributes
    ----------
    ahead_ns
        Host's clock less steady clock at the last update [ns].
    """

    def __init__(
        self,
        clock: Callable[[], int] = time.time_ns,
        steady: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._clock, self._steady = clock, steady
        took_ns, self.ahead_ns, now_ns = self._reading()
        self._updated_ns = now_ns if took_ns <= _AT_ONCE_NS else -math.inf

    def __call__(self) -> int:
        """Return the host's time [ns]."""
        return self._steady() + self.ahead_ns

    def update(self) -> int:
        """Follow the host's clock; return by how much it was set [ns], 0 if it was not."""
        took_ns, ahead_ns, now_ns = self._reading()
        if took_ns > _AT_ONCE_NS:
            return 0
        step_ns, elapsed_ns = ahead_ns - self.ahead_ns, now_ns - self._updated_ns
        self.ahead_ns, self._updated_ns = ahead_ns, now_ns
        if abs(step_ns) <= _LEAST_NS + _DRIFT * elapsed_ns:
            return 0
        return step_ns

    def _reading(self) -> tuple[int, int, int]:
        """Return the time that reading both took, host's less steady clock, and the time [ns]."""
        readings = []
        for _ in range(_ATTEMPTS):
            before_ns, clock_ns, after_ns = self._steady(), self._clock(), self._steady()
            ahead_ns = clock_ns - (before_ns + after_ns) // 2
            readings.append((after_ns - before_ns, ahead_ns, after_ns))
            if after_ns - before_ns <= _QUICK_NS:
                break
        return min(readings)


class SteadyTime:
    """Converts times of the raw clock to the steady clock, between whose readings it is linear.

    Parameters
    ----------
    steady, raw
        Return the time of the steady clock and of the raw clock [ns].
    """

    def __init__(
        self,
        steady: Callable[[], int] = time.monotonic_ns,
        raw: Callable[[], int] = raw_ns,
    ) -> None:
        self._raw, self._ahead = raw, HostTime(steady, raw)
        self._readings: deque[tuple[int, int]] = deque(maxlen=_READINGS)
        self.update()

    def update(self) -> None:
        """Read both clocks; times are converted up to this one."""
        self._ahead.update()
        self._readings.append((self._raw(), self._ahead.ahead_ns))

    def __call__(self, raw_ns: Times) -> Times:
        """Return the steady times [ns] of times of the raw clock [ns], shape (n,)."""
        read_ns, ahead_ns = np.array(self._readings).T
        newer = np.interp(raw_ns - read_ns[-1], read_ns - read_ns[-1], ahead_ns - ahead_ns[-1])
        return np.asarray(raw_ns + ahead_ns[-1] + np.rint(newer).astype(np.int64))
