"""How long to wait for a reply."""

from collections import deque
import math

LONGEST_REPLY = 0.05
"""Longest wait for a reply [s]: a latency timer of 16 ms three times over."""

MARGIN = 0.003
"""A reply that takes this much longer [s] than all recent ones is lost."""

_REMEMBERED, _FEWEST = 50, 5
_MISSED = 5  # missed replies in a row, after which the usual time may have changed
_STEP = 0.001  # s; every change of the timeout configures the port again


class ReplyTimeout:
    """Learns how long replies take: a reply that takes some ms longer is lost.

    So a lost reply costs one sample with an adapter without delay, while replies through a latency
    timer of 16 ms still arrive in time.

    Parameters
    ----------
    baud_rate
        Bit rate of the bus [bit/s].
    """

    def __init__(self, baud_rate: int) -> None:
        self._byte_ns = 10e9 / baud_rate
        self._excesses: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, size: int, duration_ns: int) -> None:
        """Add the duration [ns] of a request and its reply, of `size` bytes together."""
        self._excesses.append(duration_ns - size * self._byte_ns)

    def seconds(self, size: int, missed: int) -> float:
        """Return how long to wait [s].

        Parameters
        ----------
        size
            Bytes of the request and its reply.
        missed
            Number of missed replies in a row.
        """
        if missed >= _MISSED or len(self._excesses) < _FEWEST:
            return LONGEST_REPLY
        usual = (size * self._byte_ns + max(self._excesses)) / 1e9
        return min(math.ceil((usual + MARGIN) / _STEP) * _STEP, LONGEST_REPLY)
