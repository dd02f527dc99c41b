"""The present time by the clock of the stamps, which may be that of another machine."""

from collections import deque

from nodlidar_common.nod import NS_PER_S

_RECENT = 50  # scans; the one that was fastest on its way counts
_SET_NS = NS_PER_S  # a clock that is behind by more was set back
# A clock of the host that is ahead of the stamps by less agrees with them: they were on the way.
_AGREES_NS = NS_PER_S // 10


class StampClock:
    """The clock of the machine that stamps the scans, estimated from their arrival.

    The host's clock is used as long as it agrees. If it does not, the time is late by the least
    time that one of the last scans was on its way. With one-way messages it cannot be better.
    """

    def __init__(self) -> None:
        self._ahead_ns: deque[int] = deque(maxlen=_RECENT)  # of the steady clock

    def add(self, end_ns: int, arrived_ns: int) -> None:
        """Add a scan: the instant of its last beam, and its arrival by another clock [ns]."""
        ahead_ns = end_ns - arrived_ns
        if self._ahead_ns and self.ahead_ns - ahead_ns > _SET_NS:
            self._ahead_ns.clear()
        self._ahead_ns.append(ahead_ns)

    def shift(self, step_ns: int) -> None:
        """Go on after the clock was set by a step [ns]."""
        self._ahead_ns = deque((each + step_ns for each in self._ahead_ns), _RECENT)

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
