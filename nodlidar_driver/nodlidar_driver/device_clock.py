"""The lidar's clock, mapped to host time.

Three things are estimated, each from what shows it best:

- the time of step 0 on the device's clock, finer than its milliseconds, from the evenness of the
  rotations (:mod:`nodlidar_driver.rotation`);
- the drift between the clocks, from the earliest arrivals of the last half a minute
  (:mod:`nodlidar_driver.arrivals`);
- the absolute offset, from the earliest answers of time mode at connection. Scans arrive a fixed
  but unknown latency after step 0. The offset of time mode reveals it during the first seconds;
  from then on the earliest arrivals less the latency are the offset, also after a clock was set.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_driver.arrivals import Arrivals, WINDOW_MS
from nodlidar_driver.envelope import least
from nodlidar_driver.rotation import even_times, RotationTimes
from nodlidar_driver.timer import Timer
import numpy as np
from numpy.typing import NDArray

_NS_PER_MS = 1e6
_CALIBRATION_MS = 0.9 * WINDOW_MS  # how long the latency is refined
_LATENCY_LIMIT_MS = 1_000.0  # a longer latency is not believed
_FEWEST_REPLIES, _MOST_REPLIES = 10, 24  # one comes in each rotation
_NO_REPLIES = (np.empty(0), np.empty(0))
_SHARP_MS = 0.05  # mean delay per reply at which more of them would tell nothing new


@dataclass(frozen=True, slots=True)
class TimeReply:
    """An answer of time mode: the device's timer [ms, 24 bits] and when it arrived [ns]."""

    device_ms: int
    arrival_ns: int


@dataclass(frozen=True, slots=True)
class ScanTime:
    """When a scan was taken, in host time.

    Attributes
    ----------
    step_zero_ns
        Instant of step 0 [ns].
    rotation
        Time of one rotation [s], as measured.
    turns
        Rotations since the scan before, 1 when there was none.
    """

    step_zero_ns: int
    rotation: float
    turns: int


def enough_replies(replies: Sequence[TimeReply]) -> bool:
    """Tell whether time mode has been asked often enough, judged by the scatter of the delays."""
    if not _FEWEST_REPLIES <= len(replies) < _MOST_REPLIES:
        return len(replies) >= _MOST_REPLIES
    timer, first_ns = Timer(), replies[0].arrival_ns
    times = [timer.unwrap(reply.device_ms, reply.arrival_ns) for reply in replies]
    delays = np.subtract([(reply.arrival_ns - first_ns) / _NS_PER_MS for reply in replies], times)
    return float(delays.mean() - delays.min()) < _SHARP_MS * (len(delays) - 1)


class DeviceClock:
    """Maps the time stamps of scans to host time.

    Parameters
    ----------
    rotation_ms
        Nominal time of one rotation [ms].
    measured_ms
        Time from step 0 to the last measured beam [ms]: no scan can arrive earlier.
    replies
        Answers of time mode, taken just before the stream.

    Attributes
    ----------
    synchronised
        Whether time mode gave a latency that is possible. If not, scans are taken to arrive one
        rotation after step 0.
    """

    def __init__(
        self, rotation_ms: float, measured_ms: float, replies: Sequence[TimeReply]
    ) -> None:
        self.synchronised = False
        self._measured_ms = measured_ms
        self._rotation_ms = self._latency_ms = rotation_ms
        self._timer = Timer()
        self._rotations = RotationTimes(rotation_ms)
        self._arrivals = Arrivals()
        self._origin_ns: int | None = None
        stamps = [self._timer.unwrap(reply.device_ms, reply.arrival_ns) for reply in replies]
        arrivals = [self._since_origin(reply.arrival_ns) for reply in replies]
        self._replies = np.array(stamps, dtype=np.float64), np.array(arrivals)
        self._reply_rotations = RotationTimes(rotation_ms)
        for stamp in stamps:
            self._reply_rotations.add(stamp)

    @property
    def drift_ppm(self) -> float:
        """By how much the device's clock is faster than the host's [parts per million]."""
        return -self._arrivals.line.slope * 1e6

    @property
    def jitter(self) -> float:
        """Mean lateness of the scans [s]."""
        return self._arrivals.line.scatter * 1e-3

    @property
    def jumps(self) -> int:
        """How often either clock was set: the device restarted, or the host's was stepped."""
        return self._timer.jumps + self._arrivals.jumps

    def scan_time(self, device_ms: int, arrival_ns: int) -> ScanTime:
        """Return when a scan was taken.

        Parameters
        ----------
        device_ms
            The scan's time stamp: the device's timer at step 0 [ms, 24 bits].
        arrival_ns
            Host time at which the scan's last byte was read [ns].
        """
        jumps = self.jumps
        stamp_ms = self._timer.unwrap(device_ms, arrival_ns)
        if self.jumps > jumps:
            self._arrivals.clear()
            self._rotations = RotationTimes(self._rotation_ms)
        zeros_ms = self._rotations.add(stamp_ms)
        self._arrivals.add(zeros_ms, self._since_origin(arrival_ns))
        if self.jumps > jumps:
            self._replies = _NO_REPLIES
        self._calibrate(zeros_ms)
        return self._result(float(zeros_ms[-1]))

    def _since_origin(self, host_ns: int) -> float:
        """Return a host time from the first one that was seen [ms], where floats are fine."""
        if self._origin_ns is None:
            self._origin_ns = host_ns
        return (host_ns - self._origin_ns) / _NS_PER_MS

    def _calibrate(self, zeros_ms: NDArray[np.float64]) -> None:
        """Refine the latency as long as the answers of time mode are near.

        The lidar answers once in a rotation, so that the answers' cut off fractions are found as
        those of the scans are. If it did not answer evenly the whole milliseconds do: the answers
        that seem least delayed are then those of which least was cut off.
        """
        stamps, arrivals = self._replies
        if not len(stamps):
            return
        known_best = self._rotations if len(zeros_ms) > len(stamps) else self._reply_rotations
        times = even_times(stamps, known_best.period_ms)
        line, middle = self._arrivals.line, times.mean()
        offset = least(arrivals - times - line.slope * (times - middle))
        latency_ms = line.value - offset - line.slope * (float(zeros_ms[-1]) - middle)
        self.synchronised = self._measured_ms - 1.0 <= latency_ms <= _LATENCY_LIMIT_MS
        if self.synchronised:
            self._latency_ms = latency_ms
        if self._arrivals.span_ms > _CALIBRATION_MS:
            self._replies = _NO_REPLIES

    def _result(self, zero_ms: float) -> ScanTime:
        line = self._arrivals.line
        host_ms = zero_ms + line.value - self._latency_ms
        assert self._origin_ns is not None
        return ScanTime(
            step_zero_ns=self._origin_ns + round(host_ms * _NS_PER_MS),
            rotation=self._rotations.period_ms * (1.0 + line.slope) * 1e-3,
            turns=self._rotations.turns,
        )
