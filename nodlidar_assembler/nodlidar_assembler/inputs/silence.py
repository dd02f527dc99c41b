"""Detects when a periodic input stops."""

from nodlidar_common.nod import NS_PER_S

LEAST_SILENCE = 0.5  # [s]; shorter pauses come from the host, not the sensor
_INTERVALS = 4.0  # a pause of so many usual intervals is a silence
_SHARE = 0.1  # weight of a new interval in the usual one
_LONGEST = NS_PER_S  # longest interval that counts as usual [ns]


class Silence:
    """Compares the time since an input's last message with the usual interval.

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
        """Return the time of silence [s]; 0 if it is usual or no message has come yet."""
        if self._last_ns is None:
            return 0.0
        silence = (now_ns - self._last_ns) / NS_PER_S
        limit = max(LEAST_SILENCE, _INTERVALS * self._interval_ns / NS_PER_S)
        return silence if silence > limit else 0.0
