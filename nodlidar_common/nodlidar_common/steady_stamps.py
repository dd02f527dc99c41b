"""Instants of samples that are taken with a steady period, from stamps that jitter."""

from collections import deque
from statistics import median_low

SAMPLES = 25  # whose jitter is compared; of lost samples, half as many stay wrong
LONGEST = 10  # periods between two stamps; after more, samples were lost or time was set


class SteadyStamps:
    """Follows the line of a steady period through stamps that are off it back and forth.

    It is as late as the median of the last stamps, which a few late ones do not move.

    Parameters
    ----------
    period_ns
        From sample to sample [ns], to a few per mille; with 0, stamps stay as they are.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._late_ns: deque[int] = deque(maxlen=SAMPLES)  # the last stamps, after the line
        self._stamp_ns = self._line_ns = self._steady_ns = 0

    def of(self, stamp_ns: int) -> int:
        """Return the instant of the next sample [ns]; that of a repeated stamp is the same."""
        if not self._period_ns:
            return stamp_ns
        gap_ns, self._stamp_ns = stamp_ns - self._stamp_ns, stamp_ns
        if not gap_ns:
            return self._steady_ns
        if abs(gap_ns) > LONGEST * self._period_ns:
            self._late_ns.clear()
            self._line_ns = self._steady_ns = stamp_ns - self._period_ns
        self._line_ns += self._period_ns
        self._late_ns.append(stamp_ns - self._line_ns)
        self._steady_ns = max(self._steady_ns + 1, self._line_ns + median_low(self._late_ns))
        return self._steady_ns
