"""When the lidar's revolutions begin, in host time, from the stamps of its scans."""

import math

from nodlidar_common.arrays import Integers
from nodlidar_common.stamps import NS_PER_S
import numpy as np

WINDOW = 300
"""Scans in the fit: half a minute at 10 Hz, which reduces a jitter of 0.3 ms to 0.04 ms."""

FEWEST = 20
"""Scans from which on the scatter of stamps is known."""

_FIT_EVERY = 5  # scans, from FEWEST on: the line hardly changes with each

GATE_NS = 5_000_000
"""A stamp farther off a known line is a stray, or the lidar restarted."""

_OFF_RATE = 0.03
"""Share by which the period may be off that which scans state, until enough stamps show it."""

SAME_RATE = 0.1
"""Share by which the nominal period of revolutions may differ from scan to scan."""

_STRAYS_TO_RESTART = 5
_NO_STAMPS = np.empty((0, 2), dtype=np.int64)  # count, stamp [ns]
_NOMINAL_WEIGHT = 25.0
"""Weight of the nominal period against the stamps: their scatter (0.5 ms) over the error of that
period (0.1 ms), squared. The first few stamps show mostly their jitter, not the period."""


class Revolutions:
    """A line through the last stamps: revolution k began `k - count` periods after `begin_ns`.

    Revolutions are counted in integers, and the line is fitted to differences of integer
    nanoseconds from the newest stamp: no error accumulates over hours. Missing scans are counted.
    A stamp off the line, or with another nominal period, is left out. After several in a row (the
    lidar was switched off and on) counting continues from there on a new line.

    Attributes
    ----------
    count
        The revolution of the newest stamp, counted from 0 at the first one.
    begin_ns
        Instant of its first beam, by the line [ns].
    restarts
        Number of new lines. The count is then unrelated to that on the line before: the lidar
        restarted with another phase.
    scatter
        Root mean square of the stamps about the line [s]; infinite before FEWEST of them.
    """

    def __init__(self) -> None:
        self.count = 0
        self.restarts = 0
        self.scatter = math.inf
        self._stamps: Integers = _NO_STAMPS
        self._strays = self._unfitted = 0
        self.begin_ns = 0
        self._nominal_ns = self._period_ns = self._doubt_ns = 0.0

    @property
    def period(self) -> float:
        """Time of one revolution [s] in host time."""
        return self._period_ns / NS_PER_S

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        self._stamps[:, 1] += step_ns
        self.begin_ns += step_ns

    def add(self, stamp_ns: int, nominal: float) -> bool:
        """Add the stamp of a scan.

        Parameters
        ----------
        stamp_ns
            Instant of the scan's first beam [ns].
        nominal
            Time of a revolution [s], positive, known without the stamps; used when a line begins.

        Returns
        -------
        bool
            Whether the stamp is on the line.
        """
        if not len(self._stamps):
            self._begin(stamp_ns, nominal)
            return True
        if not self.has(stamp_ns, nominal):
            return self._stray(stamp_ns, nominal)
        self._strays = 0
        revolutions = round((stamp_ns - self.begin_ns) / self._period_ns)
        self.count += revolutions
        self._remember(stamp_ns)
        self.begin_ns += round(revolutions * self._period_ns)
        self._unfitted += 1
        if len(self._stamps) <= FEWEST or self._unfitted >= _FIT_EVERY:
            self._fit()
        return True

    def has(self, stamp_ns: int, nominal: float) -> bool:
        """Return whether the stamp of a scan is on the line, after all before; see `add`."""
        revolutions = round((stamp_ns - self.begin_ns) / self._period_ns)
        same_rate = abs(nominal * NS_PER_S / self._nominal_ns - 1.0) <= SAME_RATE
        gate_ns = GATE_NS + self._doubt_ns
        return revolutions >= 1 and abs(self.off_ns(stamp_ns)) <= gate_ns and same_rate

    def off_ns(self, stamp_ns: int) -> float:
        """Return by how much a stamp is later than the nearest revolution [ns]; 0 before any."""
        if not self._period_ns:
            return 0.0
        return math.remainder(stamp_ns - self.begin_ns, self._period_ns)

    def _stray(self, stamp_ns: int, nominal: float) -> bool:
        self._strays += 1
        if self._strays < _STRAYS_TO_RESTART:
            return False
        self.restart(stamp_ns, nominal)
        return True

    def restart(self, stamp_ns: int, nominal: float) -> None:
        """Begin a new line with the stamp of a scan, as of another lidar; see `add`."""
        self.restarts += 1
        self._begin(stamp_ns, nominal)

    def _begin(self, stamp_ns: int, nominal: float) -> None:
        self._strays, self.scatter = 0, math.inf
        self._stamps = _NO_STAMPS
        self._remember(stamp_ns)
        self.begin_ns = stamp_ns
        self._nominal_ns = self._period_ns = nominal * NS_PER_S
        self._doubt_ns = _OFF_RATE * self._nominal_ns

    def _remember(self, stamp_ns: int) -> None:
        new = np.array([[self.count, stamp_ns]], dtype=np.int64)
        self._stamps = np.concatenate([self._stamps[1 - WINDOW :], new])

    def _fit(self) -> None:
        """Fit the line by least squares, with the nominal period as one more observation."""
        self._unfitted = 0
        revolutions, since_ns = (self._stamps - self._stamps[-1]).T.astype(np.float64)
        offsets = since_ns - self._nominal_ns * revolutions
        middle, mean = revolutions.mean(), offsets.mean()
        centred = revolutions - middle
        spread = float(centred @ centred) + _NOMINAL_WEIGHT
        excess = float(centred @ (offsets - mean)) / spread
        self._period_ns = self._nominal_ns + excess
        # How far off the next stamp may be: the nominal period is believed, by its weight.
        believed = _NOMINAL_WEIGHT / spread
        self._doubt_ns = _OFF_RATE * self._nominal_ns * believed * (1.0 - middle)
        self.begin_ns = int(self._stamps[-1, 1]) + round(mean - excess * middle)
        if len(revolutions) >= FEWEST:
            off = offsets - mean - excess * centred
            self.scatter = math.sqrt(float(off @ off) / len(off)) / NS_PER_S
