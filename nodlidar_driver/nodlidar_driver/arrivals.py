"""When scans arrive: the line of the earliest ones, which lateness does not bend."""

from dataclasses import replace
import math

from nodlidar_driver.envelope import Line, lower_line
import numpy as np
from numpy.typing import NDArray

WINDOW_MS = 30_000.0  # a warming quartz drifts straight for so long
_LATE_MS, _LATE_SCATTERS = 2.0, 6.0  # later than so much beyond the line says nothing about it
_EARLY_MS, _EARLY_SCATTERS = 3.0, 3.0  # earlier by more: the line was one of late scans
# How long the line may be extended: a drift that is off by 100 or 20 ppm makes 2 ms of it.
_KNOWN_MS = 15_000.0  # after so long the drift is known
_TRUSTED_MS, _TRUSTED_WHEN_KNOWN_MS = 20_000.0, 100_000.0


class Arrivals:
    """The scans of the last half a minute: when each was taken, and when it arrived.

    Attributes
    ----------
    line
        How much later than on the device's clock they arrive at least, at the newest scan [ms].
    late_ms
        How much later than that the newest one arrived [ms].
    """

    def __init__(self) -> None:
        self.line = Line(0.0, 0.0, 0.0)
        self.late_ms = 0.0
        self.clear()

    def __len__(self) -> int:
        return len(self._taken_ms)

    @property
    def span_ms(self) -> float:
        """Time from the oldest to the newest scan [ms]."""
        return float(self._taken_ms[-1] - self._taken_ms[0]) if len(self) else 0.0

    def is_early(self, taken_ms: float, arrived_ms: float) -> bool:
        """Tell whether a scan comes so early that all before must have been late."""
        limit_ms = _EARLY_MS + _EARLY_SCATTERS * self.line.scatter
        return len(self) > 0 and arrived_ms - taken_ms < self.line.value - limit_ms

    def is_outdated(self, arrived_ms: float) -> bool:
        """Tell whether all scans have been late for longer than the line can be extended."""
        trusted_ms = _TRUSTED_WHEN_KNOWN_MS if self._known else _TRUSTED_MS
        return len(self) > 0 and arrived_ms - self._timely_ms > trusted_ms

    def clear(self) -> None:
        """Forget all scans."""
        self._taken_ms: NDArray[np.float64] = np.empty(0)
        self._arrived_ms: NDArray[np.float64] = np.empty(0)
        self._timely_ms = 0.0
        self._known = False

    def add(self, taken_ms: NDArray[np.float64], arrived_ms: float) -> None:
        """Take a scan and fit the line of the least delays anew.

        A scan that waited, for a busy host or in a slow line, says nothing about the line, however
        many of them do: the device's clock goes on, and the line is extended.

        Parameters
        ----------
        taken_ms
            When this scan (the last one) and those before it were taken, on the device's clock:
            what is known better now replaces what was known before, shape (n,), n >= 1.
        arrived_ms
            When this scan arrived, on the host's clock.
        """
        at_ms = float(taken_ms[-1])
        delay_ms = arrived_ms - at_ms
        if len(self):
            value_ms = self.line.value + self.line.slope * (at_ms - float(self._taken_ms[-1]))
            self.line = replace(self.line, value=value_ms)
        limit_ms = _LATE_MS + _LATE_SCATTERS * self.line.scatter
        timely = not len(self) or delay_ms - self.line.value <= limit_ms
        self._append(taken_ms, arrived_ms if timely else math.nan)
        if timely:
            self._timely_ms = arrived_ms
            self._fit(at_ms)
        self.late_ms = delay_ms - self.line.value

    def skip(self, taken_ms: NDArray[np.float64]) -> None:
        """Take a scan of which the arrival is not known; `taken_ms` as for :meth:`add`."""
        if len(self):
            self.add(taken_ms, math.inf)

    def _fit(self, at_ms: float) -> None:
        timely = ~np.isnan(self._arrived_ms)
        taken, arrived = self._taken_ms[timely], self._arrived_ms[timely]
        self.line = lower_line(taken, arrived - taken, at_ms)
        self._known = bool(taken[-1] - taken[0] > _KNOWN_MS)

    def _append(self, taken_ms: NDArray[np.float64], arrived_ms: float) -> None:
        """Add an arrival, renew when the scans were taken, and forget those of long ago."""
        self._arrived_ms = np.append(self._arrived_ms, arrived_ms)
        renewed = min(len(taken_ms), len(self._arrived_ms))
        kept = self._taken_ms[: len(self._arrived_ms) - renewed]
        self._taken_ms = np.concatenate((kept, taken_ms[-renewed:]))
        recent = self._taken_ms >= self._taken_ms[-1] - WINDOW_MS
        self._taken_ms, self._arrived_ms = self._taken_ms[recent], self._arrived_ms[recent]
