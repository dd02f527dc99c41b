"""Offset of the lidar's clock from the answers of time mode."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array
from nodlidar_common.errors import DeviceError
from nodlidar_driver.clock.envelope import least
from nodlidar_driver.clock.revolution import even_times, RevolutionTimes
from nodlidar_driver.clock.timer import unwrapped
import numpy as np

_NS_PER_MS = 1e6
# One reply comes in each revolution. The least of n delays is their mean over n, on average.
_FEWEST_REPLIES, _MANY_REPLIES, _MOST_REPLIES = 5, 24, 60
_SHARP_MS = 0.15  # mean delay per reply at which further replies add nothing
_LEAST_SHARP_MS = 0.5  # ... at which many replies are enough; above it, the clock remains unknown
_MOST_REVOLUTIONS = 1.5  # an answer comes at the end of a revolution, within one
# A reply that seems earlier than all others by more than this [ms] has a wrong time; one that is
# later by this many medians waited for the host.
_ALONE_MS, _LATE_MEDIANS = 5.0, 6.0


class ClockError(DeviceError):
    """The estimate of the lidar's clock is wrong; the clocks have to be aligned again."""


@dataclass(frozen=True, slots=True)
class TimeReply:
    """An answer of time mode.

    Attributes
    ----------
    device_ms
        The device's timer [ms, 24 bits].
    asked_ns, arrival_ns
        Host time of the request, and of reading the answer [ns].
    """

    device_ms: int
    asked_ns: int
    arrival_ns: int


class Replies:
    """Answers of time mode, without those of a wrong time or that waited.

    Parameters
    ----------
    replies
        The answers, at least one.
    revolution_ms
        Nominal time of one revolution [ms].

    Attributes
    ----------
    times_ms, arrivals_ms
        The device's timer without wraps [ms], and the arrival of the answers [ms] after that of
        the first one, shape (n,), n >= 1.
    """

    def __init__(self, replies: Sequence[TimeReply], revolution_ms: float) -> None:
        first = replies[0]
        times = [unwrapped(reply.device_ms, first.device_ms) for reply in replies]
        self.times_ms: Array = np.array(times, dtype=np.float64)
        self.arrivals_ms: Array = np.array(
            [(reply.arrival_ns - first.arrival_ns) / _NS_PER_MS for reply in replies]
        )
        self._keep_good_ones()
        self._revolutions = RevolutionTimes(revolution_ms)
        for time_ms in self.times_ms:
            self._revolutions.add(int(time_ms))

    @property
    def last_ms(self) -> int:
        """Value of the timer in the last answer [ms]."""
        return int(self.times_ms[-1])

    @property
    def offset_ms(self) -> float:
        """Host time less the device's time, for the least delay [ms]."""
        return least(self.delays())

    def times(self, revolutions: RevolutionTimes | None = None) -> Array:
        """Return the times of the answers on the device's clock [ms], finer than whole ms, (n,).

        Parameters
        ----------
        revolutions
            A better estimate of the revolution than that of the answers.
        """
        times = even_times(self.times_ms, (revolutions or self._revolutions).period_ms)
        if times is self.times_ms:  # not even: the motor's speed has changed
            times = even_times(self.times_ms, self._revolutions.period_ms)
        return times

    def delays(self) -> Array:
        """Return the differences of arrivals and times [ms], shape (n,)."""
        return self.arrivals_ms - self.times()

    def scatter_ms(self) -> float:
        """Return the mean lateness of the answers [ms], estimated from the median."""
        delays = self.delays()
        return float(np.median(delays) - delays.min()) / math.log(2.0)  # for exponential delays

    def _keep_good_ones(self) -> None:
        delays = self.arrivals_ms - self.times_ms
        order = np.argsort(delays)
        while len(order) > 2 and delays[order[1]] - delays[order[0]] > _ALONE_MS:
            order = order[1:]
        heights = delays[order] - delays[order[0]]
        kept = np.sort(order[heights <= _ALONE_MS + _LATE_MEDIANS * np.median(heights)])
        self.times_ms, self.arrivals_ms = self.times_ms[kept], self.arrivals_ms[kept]


def enough_replies(replies: Sequence[TimeReply], revolution_ms: float) -> bool:
    """Return whether there are enough replies, judged by the scatter of their delays."""
    count = len(replies)
    if not _FEWEST_REPLIES <= count < _MOST_REPLIES:
        return count >= _MOST_REPLIES
    known = Replies(replies, revolution_ms)
    scatter_ms = known.scatter_ms()
    is_sharp = scatter_ms < _SHARP_MS * (len(known.times_ms) - 1)
    return is_sharp or (count >= _MANY_REPLIES and scatter_ms <= _LEAST_SHARP_MS * count)


def check_answers(replies: Sequence[TimeReply], revolution_ms: float) -> None:
    """Raise ClockError if the line or the host delays even the fastest answers."""
    if not replies:
        return
    fastest_ms = min(reply.arrival_ns - reply.asked_ns for reply in replies) / _NS_PER_MS
    if fastest_ms > _MOST_REVOLUTIONS * revolution_ms:
        raise ClockError(
            f'answers take {fastest_ms:.0f} ms or more instead of {revolution_ms:.0f} ms: '
            'the line is too slow to date scans'
        )
    scatter_ms = Replies(replies, revolution_ms).scatter_ms()
    if scatter_ms > _LEAST_SHARP_MS * len(replies):
        raise ClockError(
            f'answers are late by {scatter_ms:.0f} ms on average: too much to date scans'
        )
