"""Tells a lidar that began anew from a driver that stamps its scans in another way."""

from collections import deque
import math


class Restamping:
    """The time from stamp to arrival of scans, before and after their stamps left the line.

    A lidar that began anew sends its scans at other instants as well, so that they are as late as
    before. If a driver stamps in another way, scans come as before, and are later or less late by
    what the stamps moved. Of the two, that which fits the arrivals better counts. The least late
    of several scans counts: a host may delay scans, but it never brings them early.

    Parameters
    ----------
    remembered
        Scans on the line that are kept.
    """

    def __init__(self, remembered: int) -> None:
        self._late_ns: deque[int] = deque(maxlen=remembered)
        self._strays_late_ns: list[int] = []

    def restart(self) -> None:
        """Forget all scans."""
        self._late_ns.clear()
        self._strays_late_ns.clear()

    def add(self, late_ns: int, is_on_line: bool) -> None:
        """Add a scan: the time from its stamp to its arrival [ns], and whether it is a stray."""
        if is_on_line:
            self._strays_late_ns.clear()
            self._late_ns.append(late_ns)
        else:
            self._strays_late_ns.append(late_ns)

    def moved_ns(self, off_ns: float, period_ns: float) -> float:
        """Return by how much stamps became later [ns] with the last strays; 0 for a lidar anew.

        Parameters
        ----------
        off_ns
            How much later the last stray is than the nearest revolution of before [ns].
        period_ns
            Time of a revolution [ns].
        """
        before_ns = min(self._late_ns, default=None)
        moved_ns = 0.0 if before_ns is None else float(before_ns - min(self._strays_late_ns))
        self._late_ns = deque(self._strays_late_ns, self._late_ns.maxlen)
        self._strays_late_ns.clear()
        off_line_ns = abs(math.remainder(moved_ns - off_ns, period_ns))
        return moved_ns if off_line_ns < abs(moved_ns) else 0.0
