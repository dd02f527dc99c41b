"""Stamps of scans over hours: drifting and wrapping timers, resets, USB and TCP, in fast time."""

from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array
from nodlidar_driver.clock.device_clock import DeviceClock
from nodlidar_driver.clock.time_mode import ClockError, enough_replies, TimeReply
import numpy as np

from bench.shared.report import Row
from bench.shared.rms import rms

TITLE = 'Errors of stamps over 2 hours: drift 80 +- 20 ppm, a wrap and 9 resets of the timer'
WRAP_MS = 1 << 24
DURATION_MS = 2 * 3.6e6
WRAP_AT = 0.05  # share of the duration; the first reset is at 0.1
RESETS = 9
SETTLED_MS = 30_000.0  # after connecting
_HOST_NS = 10**15


@dataclass(frozen=True, slots=True)
class Line:
    """A lidar and the line that it sends by.

    Attributes
    ----------
    revolution
        [ms], of the lidar's clock.
    measured
        Share of the revolution that is measured.
    jitter
        Mean lateness of a message [ms], exponential.
    rare
        Mean lateness of one message in fifty besides [ms], as of a network that sends again.
    """

    revolution: float
    measured: float = 0.75
    jitter: float = 0.05
    rare: float = 0.0


LINES = {
    'URG, USB': Line(99.83, 0.71),
    'URG, busy USB': Line(99.83, 0.71, 3.0),
    'UST, TCP': Line(25.0037, jitter=0.2),
    'UST, TCP, WLAN': Line(25.0037, jitter=1.0, rare=20.0),
    'UST, exactly 25 ms': Line(25.0, jitter=0.2),
}


class Lidar:
    """A lidar's timer against the host's; times in ms by the lidar's quartz."""

    def __init__(self, line: Line, seed: int, wrap_ms: float) -> None:
        self._random, self.line, self.now = np.random.default_rng(seed), line, 0.0
        self.timer = wrap_ms - WRAP_MS - self._random.uniform(0.0, 1000.0)

    def host_ms(self, time: float) -> float:
        """Return host time: 80 ppm slower than the quartz, 20 more or less within an hour."""
        hour = 3.6e6 / math.tau
        return time - 80e-6 * time - 20e-6 * hour * math.sin(time / hour)

    def stamp(self) -> int:
        """Return the timer, 24 bits."""
        return int(self.now - self.timer) % WRAP_MS

    def reset(self) -> None:
        """Start the timer anew, at any phase of the revolution."""
        self.timer = self.now - self._random.uniform(0.0, 1000.0)

    def arrival_ns(self, after: float) -> int:
        """Return host time [ns] of a message that is ready some ms after now."""
        late = self._random.exponential(self.line.jitter)
        if self.line.rare and self._random.random() < 0.02:
            late += self._random.exponential(self.line.rare)
        return _HOST_NS + round((self.host_ms(self.now) + after + late) * 1e6)

    def clock(self) -> DeviceClock:
        """Return a clock that was aligned by time mode."""
        replies: list[TimeReply] = []
        while not enough_replies(replies, round(self.line.revolution)):
            asked_ns = _HOST_NS + round(self.host_ms(self.now) * 1e6)
            self.now += self.line.revolution
            replies.append(TimeReply(self.stamp(), asked_ns, self.arrival_ns(0.02)))
        self.now += self.line.revolution * self._random.uniform(1.0, 2.0)
        nominal = float(round(self.line.revolution))
        return DeviceClock(nominal, self.line.measured * nominal, replies)


def results() -> list[Row]:
    """Return the errors of the stamps for each lidar and line."""
    rows: list[Row] = []
    for name, line in LINES.items():
        settled, aligned = errors(line, seed=len(rows))
        rows.append(
            {
                'lidar, line': name,
                'RMS [ms]': rms(settled),
                '99 % [ms]': float(np.quantile(np.abs(settled), 0.99)),
                'worst [ms]': float(np.abs(settled).max()),
                'aligned again': aligned,
            }
        )
    return rows


def errors(line: Line, seed: int, duration_ms: float = DURATION_MS) -> tuple[Array, int]:
    """Return errors of stamps [ms] from SETTLED_MS after connecting, and how often it did again.

    Parameters
    ----------
    line
        The lidar and its line.
    seed
        Of the randomness.
    duration_ms
        How long the lidar streams [ms].
    """
    lidar, found, aligned = Lidar(line, seed, WRAP_AT * duration_ms), [], 0
    clock, since = lidar.clock(), lidar.now
    resets = [duration_ms * (k + 1) / (RESETS + 1) for k in range(RESETS)]
    while lidar.now < duration_ms:
        lidar.now += line.revolution
        if resets and lidar.now > resets[0]:
            resets.pop(0)
            lidar.reset()
        try:
            time = clock.scan_time(lidar.stamp(), lidar.arrival_ns(0.99 * line.revolution))
        except ClockError:
            clock, since, aligned = lidar.clock(), lidar.now, aligned + 1
            continue
        if time is not None and lidar.now - since > SETTLED_MS:
            truth = _HOST_NS + lidar.host_ms(lidar.now) * 1e6
            found.append((time.step_zero_ns - truth) / 1e6)
    return np.array(found), aligned
