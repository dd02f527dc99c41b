"""Tells when what should come again and again no longer does."""

from nodlidar_common.nod import NS_PER_S

LEAST_SILENCE = 0.5  # s; less is the host's, not the sensor's
_INTERVALS = 4.0  # as many are missing when it is silent
_SHARE = 0.1  # of a new interval in the usual one
_LONGEST = NS_PER_S  # of an interval [ns]: a silence is none


class Silence:
    """The time since the last message of an input against the usual time between them.

    All times are of the steady clock [ns].
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._interval_ns = 0.0

    def heard(self, now_ns: int) -> None:
        """Note a message."""
        if self._last_ns is not None and now_ns - self._last_ns <= _LONGEST:
            self._interval_ns += _SHARE * (now_ns - self._last_ns - self._interval_ns)
        self._last_ns = now_ns

    def seconds(self, now_ns: int) -> float:
        """Return how long it has been silent [s]; 0 if that is usual or nothing ever came."""
        if self._last_ns is None:
            return 0.0
        silence = (now_ns - self._last_ns) / NS_PER_S
        limit = max(LEAST_SILENCE, _INTERVALS * self._interval_ns / NS_PER_S)
        return silence if silence > limit else 0.0
