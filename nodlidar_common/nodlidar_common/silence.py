"""Detects when a periodic input stops."""

from collections import deque
from statistics import median

from nodlidar_common.nod import NS_PER_S

LEAST_SILENCE = 0.5  # [s]; shorter pauses come from the host, not the sensor
_INTERVALS = 4.0  # a pause of so many usual intervals is a silence
_REMEMBERED = 5  # intervals, whose median is usual: a single pause does not change it


class Silence:
    """Compares the time since an input's last message with the usual interval.

    All times are of the steady clock [ns].

    Parameters
    ----------
    first
        Longest usual pause until the second message has shown what is usual [s].
    """

    def __init__(self, first: float = LEAST_SILENCE) -> None:
        self._first = first
        self._last_ns: int | None = None
        self._intervals_ns: deque[int] = deque(maxlen=_REMEMBERED)

    def heard(self, now_ns: int) -> None:
        """Note a message."""
        if self._last_ns is not None:
            self._intervals_ns.append(now_ns - self._last_ns)
        self._last_ns = now_ns

    def seconds(self, now_ns: int) -> float:
        """Return the time of silence [s]; 0 if it is usual or no message has come yet."""
        if self._last_ns is None:
            return 0.0
        silence = (now_ns - self._last_ns) / NS_PER_S
        return silence if silence > self._limit else 0.0

    @property
    def _limit(self) -> float:
        """Longest usual pause [s]."""
        if not self._intervals_ns:
            return self._first
        return max(LEAST_SILENCE, _INTERVALS * median(self._intervals_ns) / NS_PER_S)
