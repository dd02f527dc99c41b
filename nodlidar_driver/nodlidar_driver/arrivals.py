"""When scans arrive: the line of the earliest ones, and whether a clock was set."""

import math

from nodlidar_driver.envelope import Line, lower_line
import numpy as np
from numpy.typing import NDArray

WINDOW_MS = 30_000.0  # a warming quartz drifts straight for so long
_FAR_MS = 20.0  # this far from the line is no jitter: the host was busy, or a clock was set
_FAR_SCANS = 10  # so many in a row that are late by as much are no busy host
_LATE_AT_ONCE_MS = 5_000.0  # later than anything that was waiting in a buffer


class Arrivals:
    """The scans of the last half a minute: when each was taken, and when it arrived."""

    def __init__(self) -> None:
        self.jumps = 0
        self.line = Line(0.0, 0.0, 0.0)
        self.clear()

    def __len__(self) -> int:
        return len(self._taken_ms)

    @property
    def span_ms(self) -> float:
        """Time from the oldest to the newest scan [ms]."""
        return float(self._taken_ms[-1] - self._taken_ms[0]) if len(self) else 0.0

    def clear(self) -> None:
        """Forget all scans."""
        self._taken_ms: NDArray[np.float64] = np.empty(0)
        self._arrived_ms: NDArray[np.float64] = np.empty(0)
        self._late_scans = 0

    def add(self, taken_ms: NDArray[np.float64], arrived_ms: float) -> None:
        """Take a scan and fit the line of the least delays anew, from it alone after a jump.

        A scan that waited for a busy host says nothing about the line and is left out.

        Parameters
        ----------
        taken_ms
            When this scan (the last one) and those before it were taken, on the device's clock:
            what is known better now replaces what was known before, shape (n,), n >= 1.
        arrived_ms
            When this scan arrived, on the host's clock.
        """
        late_ms = arrived_ms - float(taken_ms[-1]) - self.line.value if len(self) else 0.0
        self._late_scans = self._late_scans + 1 if late_ms > _FAR_MS else 0
        if self._jumped(late_ms):
            self.jumps += len(self) > _FAR_SCANS  # the first few may all have been late
            self.clear()
        self._append(taken_ms, math.nan if self._late_scans else arrived_ms)
        timely = ~np.isnan(self._arrived_ms)
        taken, arrived = self._taken_ms[timely], self._arrived_ms[timely]
        self.line = lower_line(taken, arrived - taken, float(taken_ms[-1]))

    def _jumped(self, late_ms: float) -> bool:
        late = late_ms > _LATE_AT_ONCE_MS or self._late_scans >= _FAR_SCANS
        return late or late_ms < -_FAR_MS

    def _append(self, taken_ms: NDArray[np.float64], arrived_ms: float) -> None:
        """Add an arrival, renew when the scans were taken, and forget those of long ago."""
        self._arrived_ms = np.append(self._arrived_ms, arrived_ms)
        renewed = min(len(taken_ms), len(self._arrived_ms))
        kept = self._taken_ms[: len(self._arrived_ms) - renewed]
        self._taken_ms = np.concatenate((kept, taken_ms[-renewed:]))
        recent = self._taken_ms >= self._taken_ms[-1] - WINDOW_MS
        self._taken_ms, self._arrived_ms = self._taken_ms[recent], self._arrived_ms[recent]
