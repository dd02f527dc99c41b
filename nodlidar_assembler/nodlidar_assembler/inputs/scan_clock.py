"""The present time by the clock of the scans' stamps, which may be that of another machine."""

from collections import deque

from nodlidar_common.stamps import NS_PER_S

_RECENT = 50  # scans; the one that was fastest on its way counts
_LATE_NS = NS_PER_S  # a scan that is later waited, or the clock was set back
_LATE_TO_SET = 3  # late scans in a row, at the pace of their stamps, of a clock that was set back
_PACE = 0.25  # share of their time by which they may arrive faster or slower
# A clock of the host that is ahead of the stamps by less agrees with them: they were on the way.
_AGREES_NS = NS_PER_S // 10


class ScanClock:
    """The clock of the machine that stamps the scans, estimated from their arrival.

    The host's clock is used as long as it agrees. If it does not, the time is late by the least
    time that one of the last scans was on its way. With one-way messages it cannot be better.

    Scans that waited, as while a program stood still, arrive faster than they are measured. If
    late scans arrive at the pace of their stamps, the clock was set back.
    """

    def __init__(self) -> None:
        self._ahead_ns: deque[int] = deque(maxlen=_RECENT)  # of the steady clock
        self._late = 0  # scans in a row
        self._first_late_ns = 0, 0  # the end and the arrival of the first of them

    def add(self, end_ns: int, arrived_ns: int) -> bool:
        """Add a scan: the instant of its last beam, and its arrival by another clock [ns].

        Return False if it is late: the time of its beams is not known.
        """
        ahead_ns = end_ns - arrived_ns
        if self._ahead_ns and self.ahead_ns - ahead_ns > _LATE_NS:
            if not self._was_set_back(end_ns, arrived_ns):
                return False
            self._ahead_ns.clear()
        self._late = 0
        self._ahead_ns.append(ahead_ns)
        return True

    def _was_set_back(self, end_ns: int, arrived_ns: int) -> bool:
        """Add a late scan; return whether those in a row are of a clock that was set back."""
        if not self._late or end_ns < self._first_late_ns[0]:
            self._late, self._first_late_ns = 0, (end_ns, arrived_ns)
        self._late += 1
        took_ns = end_ns - self._first_late_ns[0]
        off_ns = arrived_ns - self._first_late_ns[1] - took_ns
        return self._late >= _LATE_TO_SET and abs(off_ns) <= _PACE * took_ns

    def shift(self, step_ns: int) -> None:
        """Go on after the clock was set by a step [ns]."""
        self._ahead_ns = deque((each + step_ns for each in self._ahead_ns), _RECENT)
        self._late = 0

    @property
    def ahead_ns(self) -> int:
        """How far it is ahead of the clock of the arrivals [ns]; 0 without a scan."""
        return max(self._ahead_ns, default=0)

    def now_ns(self, steady_ns: int, host_ns: int) -> int:
        """Return the present time by the stamps [ns].

        Parameters
        ----------
        steady_ns, host_ns
            The present time by the steady clock and by that of the host [ns].
        """
        if not self._ahead_ns:
            return host_ns
        stamps_ns = steady_ns + self.ahead_ns
        return host_ns if 0 <= host_ns - stamps_ns <= _AGREES_NS else stamps_ns
