"""Arrivals of scans: the line of the earliest ones, which late ones do not affect."""

from dataclasses import replace
import math

from nodlidar_common.arrays import Array
from nodlidar_driver.clock.envelope import Line, lower_line
import numpy as np

WINDOW_MS = 30_000.0  # for this time the drift of a warming quartz is constant
_LATE_MS, _LATE_SCATTERS = 2.0, 6.0  # scans later than the line by more are ignored
_EARLY_MS, _EARLY_SCATTERS = 3.0, 3.0  # if one is earlier by more, the line was of late scans
# How long the line may be extended: an error of the drift of 100 or 20 ppm adds up to 2 ms.
_KNOWN_MS = 15_000.0  # after this time the drift is known
_TRUSTED_MS, _TRUSTED_WHEN_KNOWN_MS = 20_000.0, 100_000.0


class Arrivals:
    """The scans of the last 30 s: when each was taken, and when it arrived.

    Attributes
    ----------
    line
        Least delay of the arrival against the device's clock, at the newest scan [ms].
    late_ms
        How much later than that the newest scan arrived [ms].
    """

    def __init__(self) -> None:
        self.line = Line(0.0, 0.0, 0.0)
        self.late_ms = 0.0
        self.clear()

    def __len__(self) -> int:
        return len(self._taken_ms)

    @property
    def drift_ppm(self) -> float:
        """Rate of the device's clock against the host's, less 1 [parts per million]."""
        return -self.line.slope * 1e6

    @property
    def jitter(self) -> float:
        """Mean lateness of the scans [s], without those that waited."""
        return self.line.scatter * 1e-3

    @property
    def span_ms(self) -> float:
        """Time from the oldest to the newest scan [ms]."""
        return float(self._taken_ms[-1] - self._taken_ms[0]) if len(self) else 0.0

    def is_early(self, taken_ms: float, arrived_ms: float) -> bool:
        """Return whether a scan is so early that all former ones must have been late."""
        limit_ms = _EARLY_MS + _EARLY_SCATTERS * self.line.scatter
        return len(self) > 0 and arrived_ms - taken_ms < self.line.value - limit_ms

    def is_outdated(self, arrived_ms: float) -> bool:
        """Return whether all scans have been late for longer than the line can be extended."""
        trusted_ms = _TRUSTED_WHEN_KNOWN_MS if self._known else _TRUSTED_MS
        return len(self) > 0 and arrived_ms - self._timely_ms > trusted_ms

    def clear(self) -> None:
        """Forget all scans."""
        self._taken_ms: Array = np.empty(0)
        self._arrived_ms: Array = np.empty(0)
        self._timely_ms = 0.0
        self._known = False

    def begin(self, taken_ms: Array, arrived_ms: Array) -> None:
        """Begin with some scans, shape (n,) each, whose scatter is then known."""
        self.clear()
        self._taken_ms, self._arrived_ms = taken_ms, arrived_ms
        self._timely_ms = float(arrived_ms[-1])
        self._fit(float(taken_ms[-1]))

    def add(self, taken_ms: Array, arrived_ms: float) -> None:
        """Add a scan and fit the line of the least delays again.

        Scans that waited for a busy host or in a slow connection do not affect the line, however
        many there are: it is extended by the device's clock.

        Parameters
        ----------
        taken_ms
            When this scan (the last one) and former ones were taken, on the device's clock, shape
            (n,), n >= 1; better values replace those of former calls.
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

    def skip(self, taken_ms: Array) -> None:
        """Add a scan of unknown arrival; `taken_ms` as for :meth:`add`."""
        if len(self):
            self.add(taken_ms, math.inf)

    def _fit(self, at_ms: float) -> None:
        timely = ~np.isnan(self._arrived_ms)
        taken, arrived = self._taken_ms[timely], self._arrived_ms[timely]
        self.line = lower_line(taken, arrived - taken, at_ms)
        self._known = bool(taken[-1] - taken[0] > _KNOWN_MS)

    def _append(self, taken_ms: Array, arrived_ms: float) -> None:
        """Add an arrival, update when the scans were taken, and forget old ones."""
        self._arrived_ms = np.append(self._arrived_ms, arrived_ms)
        renewed = min(len(taken_ms), len(self._arrived_ms))
        kept = self._taken_ms[: len(self._arrived_ms) - renewed]
        self._taken_ms = np.concatenate((kept, taken_ms[-renewed:]))
        recent = self._taken_ms >= self._taken_ms[-1] - WINDOW_MS
        self._taken_ms, self._arrived_ms = self._taken_ms[recent], self._arrived_ms[recent]
