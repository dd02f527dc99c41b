"""When scans arrive: the line of the earliest ones, and whether a clock was set."""

from nodlidar_driver.envelope import Line, lower_line
import numpy as np
from numpy.typing import NDArray

WINDOW_MS = 30_000.0  # a warming quartz drifts straight for so long
_EARLY_MS = 20.0  # no scan comes this much before the earliest: a clock was set
_LATE_SCANS = 10  # so many in a row that are late by as much are no stall: a clock was set
_LATE_AT_ONCE_MS = 5_000.0  # later than anything that was waiting in a buffer


class Arrivals:
    """The scans of the last half a minute: when each was taken, and when it arrived."""

    def __init__(self) -> None:
        self.jumps = 0
        self.line = Line(0.0, 0.0, 0.0)
        self._late_scans = 0
        self.clear()

    def __len__(self) -> int:
        return len(self._taken_ms)

    @property
    def span_ms(self) -> float:
        """Time from the oldest to the newest scan [ms]."""
        return float(self._taken_ms[-1] - self._taken_ms[0]) if len(self) else 0.0

    def clear(self) -> None:
        """Forget all scans."""
        self._taken_ms = np.empty(0)
        self._arrived_ms = np.empty(0)
        self._late_scans = 0

    def add(self, taken_ms: NDArray[np.float64], arrived_ms: float) -> None:
        """Take a scan and fit the line of the least delays anew, from it alone after a jump.

        Parameters
        ----------
        taken_ms
            When this scan (the last one) and those before it were taken, on the device's clock:
            what is known better now replaces what was known before, shape (n,), n >= 1.
        arrived_ms
            When this scan arrived, on the host's clock.
        """
        if self._jumped(arrived_ms - float(taken_ms[-1])):
            self.jumps += 1
            self.clear()
        self._arrived_ms = np.append(self._arrived_ms, arrived_ms)
        renewed = min(len(taken_ms), len(self._arrived_ms))
        kept = self._taken_ms[: len(self._arrived_ms) - renewed]
        self._taken_ms = np.concatenate((kept, taken_ms[-renewed:]))
        recent = self._taken_ms >= self._taken_ms[-1] - WINDOW_MS
        self._taken_ms, self._arrived_ms = self._taken_ms[recent], self._arrived_ms[recent]
        self.line = lower_line(self._taken_ms, self._arrived_ms - self._taken_ms)

    def _jumped(self, delay_ms: float) -> bool:
        if not len(self):
            return False
        late_ms = delay_ms - self.line.value
        self._late_scans = self._late_scans + 1 if late_ms > _EARLY_MS else 0
        return (
            late_ms < -_EARLY_MS or late_ms > _LATE_AT_ONCE_MS or self._late_scans >= _LATE_SCANS
        )
