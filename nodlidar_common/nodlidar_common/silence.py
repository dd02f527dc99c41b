"""Detects when a periodic input stops."""

from collections import deque
from statistics import median

from nodlidar_common.stamps import NS_PER_S

LEAST_SILENCE = 0.5  # [s]; shorter pauses come from the host, not the sensor
_INTERVALS = 4.0  # a pause of this many usual intervals is a silence
_REMEMBERED = 5  # intervals, whose median is usual: a single pause does not change it


class Silence:
    """Compares the time since an input's last message with the usual interval.

    Messages that waited for a process that stood still come at once. Their stamps show the usual
    interval all the same, so that the longer of the intervals by arrival and by stamp counts.
    Times of arrival are of the steady clock [ns].

    Parameters
    ----------
    first
        Longest usual pause until the second message has shown what is usual [s].
    """

    def __init__(self, first: float = LEAST_SILENCE) -> None:
        self._first = first
        self._last_ns: tuple[int, int] | None = None  # arrival and stamp
        self._intervals_ns: deque[int] = deque(maxlen=_REMEMBERED)

    @property
    def ever_heard(self) -> bool:
        """Whether a message has come."""
        return self._last_ns is not None

    def heard(self, now_ns: int, stamp_ns: int = 0) -> None:
        """Note a message and, where it may have waited, its stamp [ns]."""
        now = now_ns, stamp_ns
        if self._last_ns is not None:
            intervals = (new - last for new, last in zip(now, self._last_ns, strict=True))
            self._intervals_ns.append(max(intervals))
        self._last_ns = now

    def seconds(self, now_ns: int) -> float:
        """Return the time of silence [s]; 0 if it is usual or no message has come yet."""
        if self._last_ns is None:
            return 0.0
        silence = (now_ns - self._last_ns[0]) / NS_PER_S
        return silence if silence > self._limit else 0.0

    @property
    def _limit(self) -> float:
        """Longest usual pause [s]."""
        if not self._intervals_ns:
            return self._first
        return max(LEAST_SILENCE, _INTERVALS * median(self._intervals_ns) / NS_PER_S)
