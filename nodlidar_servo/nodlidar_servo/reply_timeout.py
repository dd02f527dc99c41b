"""How long a reply is waited for."""

from collections import deque
import math

LONGEST = 0.05
"""Longest wait for a reply [s]: a latency timer of 16 ms three times over."""

MARGIN = 0.003
"""A reply that takes longer than all of late by this time [s] does not come any more."""

_REMEMBERED, _FEWEST = 50, 5
_MISSED = 5  # replies in a row without which what is usual may have changed
_STEP = 0.001  # s; a port is configured anew for another timeout


class ReplyTimeout:
    """Learns how long replies take: what exceeds that by some ms is a reply that was lost.

    With an adapter that passes on at once a lost reply then costs one sample, and those of a
    latency timer of 16 ms are still waited for.

    Parameters
    ----------
    baud_rate
        Of the bus [bit/s].
    """

    def __init__(self, baud_rate: int) -> None:
        self._byte_ns = 10e9 / baud_rate
        self._excesses: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, size: int, duration_ns: int) -> None:
        """Take note of how long [ns] request and reply, of so many bytes, took."""
        self._excesses.append(duration_ns - size * self._byte_ns)

    def seconds(self, size: int, missed: int) -> float:
        """Return how long to wait [s].

        Parameters
        ----------
        size
            Bytes of the request and its reply.
        missed
            How many replies in a row did not come.
        """
        if missed >= _MISSED or len(self._excesses) < _FEWEST:
            return LONGEST
        usual = (size * self._byte_ns + max(self._excesses)) / 1e9
        return min(math.ceil((usual + MARGIN) / _STEP) * _STEP, LONGEST)
