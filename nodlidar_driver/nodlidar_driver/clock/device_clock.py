"""The lidar's clock, mapped to host time.

Host time is that of a clock that is never slewed, such as CLOCK_MONOTONIC_RAW. Three quantities
are estimated, each from the data that show it best:

- the time of step 0 on the device's clock, finer than its milliseconds, from the evenness of the
  revolutions (:mod:`nodlidar_driver.clock.revolution`);
- the drift between the clocks, from the earliest arrivals of the last 30 s
  (:mod:`nodlidar_driver.clock.arrivals`);
- the absolute offset, from the earliest answers of time mode at connection. Scans arrive a fixed
  but unknown latency after step 0. The offset of time mode reveals it during the first seconds;
  from then on the offset is the earliest arrivals less the latency.

Scans that arrive late are dated by the device's clock, too. A stamp is refused if it breaks the
even revolutions or is later than its arrival. Several in a row are a ClockError: the clocks have
to be aligned again by time mode.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_driver.clock.arrivals import Arrivals, WINDOW_MS
from nodlidar_driver.clock.envelope import least
from nodlidar_driver.clock.revolution import RevolutionTimes
from nodlidar_driver.clock.stamp_check import StampCheck
from nodlidar_driver.clock.time_mode import check_answers, ClockError, Replies, TimeReply
from nodlidar_driver.clock.timer import unwrapped

_NS_PER_MS = 1e6
_CALIBRATION_MS = 0.9 * WINDOW_MS  # how long the latency is refined
_LATENCY_LIMIT_MS = 1_000.0  # if the latency is longer, the scans waited
_ACAUSAL_MS = 1.0  # a scan may seem to arrive this much before it was measured
_MOST_REFUSED = 5  # refused stamps in a row, after which the clocks are aligned again


@dataclass(frozen=True, slots=True)
class ScanTime:
    """When a scan was taken, in host time.

    Attributes
    ----------
    step_zero_ns
        Instant of step 0 [ns].
    revolution
        Time of one revolution [s], as measured.
    revolutions
        Revolutions since the former scan; 0 without one.
    late
        How much later it arrived than the earliest scans do [s].
    """

    step_zero_ns: int
    revolution: float
    revolutions: int
    late: float


class DeviceClock:
    """Maps the time stamps of scans to host time.

    Parameters
    ----------
    revolution_ms
        Nominal time of one revolution [ms].
    measured_ms
        Time from step 0 to the last measured beam [ms]: no scan can arrive earlier.
    replies
        Answers of time mode just before the stream; none if the lidar refuses it. Then scans are
        assumed to arrive one revolution after step 0.

    Raises
    ------
    ClockError
        If the answers took too long, or their delays scatter too much, to find the offset.
    """

    def __init__(
        self, revolution_ms: float, measured_ms: float, replies: Sequence[TimeReply]
    ) -> None:
        check_answers(replies, revolution_ms)
        self._origin_ns = replies[0].arrival_ns if replies else None
        self._replies = Replies(replies, revolution_ms) if replies else None
        self.synchronised = bool(replies)
        self._measured_ms = measured_ms
        self._latency_ms = revolution_ms
        hint_ms = self._replies.last_ms if self._replies else None
        self._check = StampCheck(revolution_ms, hint_ms)
        self._revolutions = RevolutionTimes(revolution_ms)
        self._arrivals = Arrivals()
        self._stamp_ms: int | None = None  # of the last scan that was believed
        self._dated_ms: int | None = None  # and of the last one that was dated
        self._refused = 0

    @property
    def settled(self) -> bool:
        """Whether a scan has been dated."""
        return self._dated_ms is not None

    @property
    def drift_ppm(self) -> float:
        """Rate of the device's clock against the host's, less 1 [parts per million]."""
        return self._arrivals.drift_ppm

    @property
    def jitter(self) -> float:
        """Mean lateness of the scans [s], without those that waited."""
        return self._arrivals.jitter

    def scan_time(self, device_ms: int, arrival_ns: int) -> ScanTime | None:
        """Return when a scan was taken; None if its stamp is not, or not yet, believed.

        Parameters
        ----------
        device_ms
            The scan's time stamp: the device's timer at step 0 [ms, 24 bits].
        arrival_ns
            Host time at which the scan's last byte was read [ns].

        Raises
        ------
        ClockError
            If the lidar's clock has to be aligned again.
        """
        arrived_ms = self._since_origin(arrival_ns)
        if self._arrivals.is_outdated(arrived_ms):
            raise ClockError(f'all scans are late, now by {self._arrivals.late_ms:.0f} ms')
        stamp_ms = self._unwrapped(device_ms)
        believed = [] if self._is_acausal(stamp_ms, arrived_ms) else self._believed(stamp_ms)
        if not believed:
            self._refuse()
            return None
        self._stamp_ms = stamp_ms
        for each_ms in believed[:-1]:
            self._arrivals.skip(self._revolutions.add(each_ms))
        zeros_ms = self._revolutions.add(stamp_ms)
        self._add_arrival(zeros_ms, arrived_ms)
        if self._latency_ms > _LATENCY_LIMIT_MS:
            return None  # it waited since before the stream was read; later ones arrive in time
        self._refused, last_ms, self._dated_ms = 0, self._dated_ms, stamp_ms
        revolutions = (
            0 if last_ms is None else round((stamp_ms - last_ms) / self._revolutions.period_ms)
        )
        return self._result(float(zeros_ms[-1]), revolutions)

    def _since_origin(self, host_ns: int) -> float:
        """Return a host time relative to the first one [ms], where floats are precise enough."""
        if self._origin_ns is None:
            self._origin_ns = host_ns
        return (host_ns - self._origin_ns) / _NS_PER_MS

    def _unwrapped(self, device_ms: int) -> int:
        if self._stamp_ms is not None:
            return unwrapped(device_ms, self._stamp_ms)
        return unwrapped(device_ms, self._replies.last_ms) if self._replies else device_ms

    def _is_acausal(self, stamp_ms: int, arrived_ms: float) -> bool:
        """Return whether by its stamp the scan arrived before it was measured."""
        if len(self._arrivals):
            offset_ms = self._arrivals.line.value - self._latency_ms
        elif self._replies:
            offset_ms = self._replies.offset_ms
        else:
            return False
        return arrived_ms < stamp_ms + offset_ms + self._measured_ms - _ACAUSAL_MS

    def _believed(self, stamp_ms: int) -> list[int]:
        believed = self._check.believe(stamp_ms, self._revolutions.period_ms)
        if self._check.broken:
            raise ClockError("the lidar's timer was set")
        return believed

    def _refuse(self) -> None:
        self._refused += 1
        if self._refused >= _MOST_REFUSED:
            raise ClockError(
                "the scans' time stamps do not fit the lidar's clock, or its motor turns at "
                'another speed than it states: switch the lidar off and on'
            )

    def _add_arrival(self, zeros_ms: Array, arrived_ms: float) -> None:
        if self._arrivals.is_early(float(zeros_ms[-1]), arrived_ms):
            if self.synchronised and self._replies is None:
                raise ClockError('scans arrive earlier than before: the former ones were late')
            self._arrivals.clear()
        self._arrivals.add(zeros_ms, arrived_ms)
        self._calibrate(zeros_ms)

    def _calibrate(self, zeros_ms: Array) -> None:
        """Refine the latency while the answers of time mode are recent.

        The lidar answers once in a revolution, so that the truncated fractions of the answers are
        found as those of the scans are. If the answers are not even, whole milliseconds are used:
        the answers that seem least delayed are then those with the smallest fractions.
        """
        if self._replies is None:
            return
        known_best = self._revolutions if len(zeros_ms) > len(self._replies.times_ms) else None
        times = self._replies.times(known_best)
        line, middle = self._arrivals.line, times.mean()
        offset = least(self._replies.arrivals_ms - times - line.slope * (times - middle))
        self._latency_ms = line.value - offset - line.slope * (float(zeros_ms[-1]) - middle)
        if self._arrivals.span_ms > _CALIBRATION_MS and self._latency_ms <= _LATENCY_LIMIT_MS:
            self._replies = None

    def _result(self, zero_ms: float, revolutions: int) -> ScanTime:
        line = self._arrivals.line
        host_ms = zero_ms + line.value - self._latency_ms
        assert self._origin_ns is not None
        return ScanTime(
            step_zero_ns=self._origin_ns + round(host_ms * _NS_PER_MS),
            revolution=self._revolutions.period_ms * (1.0 + line.slope) * 1e-3,
            revolutions=revolutions,
            late=self._arrivals.late_ms * 1e-3,
        )
