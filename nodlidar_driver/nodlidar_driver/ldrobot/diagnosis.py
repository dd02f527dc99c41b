"""What the driver reports about an LD06 or LD19 and its scans."""

from collections import Counter
from dataclasses import dataclass, field, replace
import math
from typing import Any

from nodlidar_common.ldrobot import ROTATION_RATE
from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_driver.ldrobot.lidar import LdrobotLidar, LdrobotScan
from nodlidar_driver.scip.diagnosis import late_warnings

_SILENCE = 0.5  # s without a scan
_LEAST_RATE, _RATE_PERIOD = 7.5, 1.0  # scans per second, and s over which they are counted
_REMEMBERED = 100  # scans whose lateness is kept for the next report
_CLOCK_STEPS = 'Host clock steps'


@dataclass(frozen=True, slots=True)
class _State:
    """The lidar and its scans so far; counts are over all connections."""

    is_connected: bool = False
    heard_ns: int = 0  # of the latest scan, or else of the connection
    latency: float = math.nan  # s, from first beam to arrival
    speed: float = math.nan  # revolutions per second
    uneven: float = math.nan  # rad; see LdrobotScan
    drift_ppm: float = 0.0
    jitter: float = 0.0  # s
    scans: int = 0
    lateness: tuple[float, ...] = ()  # s, of the latest scans
    lost: Counter[str] = field(default_factory=Counter)  # by name, with steps of the clock
    last_clock_step: float = 0.0  # s


class LdrobotDiagnosis:
    """Reports the lidar's state.

    The device's thread calls `connected`, `published`, `clock_set` and `disconnected`, the thread
    of the diagnostics `urgent` and `next_report`. Only an immutable state goes from one to the
    other.
    """

    def __init__(self) -> None:
        self._lidar: LdrobotLidar | None = None
        self._before: Counter[str] = Counter()  # lost in former connections
        self._state = self._reported = _State()
        self._recent = Recent(_RATE_PERIOD)

    # The device's thread.

    def connected(self, lidar: LdrobotLidar, now_ns: int) -> None:
        """Report about this lidar from a time [ns] on."""
        self._lidar = lidar
        self._update(is_connected=True, heard_ns=now_ns, latency=math.nan)

    def published(self, scan: LdrobotScan) -> None:
        """Count a scan that was published."""
        assert self._lidar is not None
        state = self._state
        self._update(
            heard_ns=scan.arrival_ns,
            latency=(scan.arrival_ns - scan.stamp_ns) * 1e-9,
            speed=1.0 / scan.revolution,
            uneven=scan.uneven,
            drift_ppm=self._lidar.arrivals.drift_ppm,
            jitter=self._lidar.arrivals.jitter,
            scans=state.scans + 1,
            lateness=(*state.lateness[1 - _REMEMBERED :], scan.late),
        )

    def clock_set(self, step_ns: int) -> None:
        """Count a step of the host's clock [ns]; 0 is none."""
        if step_ns:
            self._before[_CLOCK_STEPS] += 1
            self._update(last_clock_step=step_ns / 1e9)

    def disconnected(self) -> None:
        """Report only the counts until connected again."""
        if self._lidar is not None:
            self._before += self._lidar.lost
        self._lidar = None
        self._update(is_connected=False)

    def _update(self, **changes: Any) -> None:
        lost = self._before + (self._lidar.lost if self._lidar else Counter())
        self._state = replace(self._state, lost=lost, **changes)

    # The thread of the diagnostics.

    def urgent(self, now_ns: int) -> tuple[object, ...]:
        """Return silence and the counts of what went wrong, at a time [ns]."""
        return self._silence(now_ns) > 0.0, self._state.lost.total()

    def next_report(self, now_ns: int) -> Report:
        """Return the state at a time [ns] by the clock of the scans' arrival.

        Warnings are about what happened since the last report.
        """
        state, before = self._state, self._reported
        self._reported = state
        warnings, news = [], state.lost - before.lost
        new = state.scans - before.scans
        if news.pop(_CLOCK_STEPS, 0):
            warnings.append(f"the host's clock was set by {state.last_clock_step} s")
        warnings += [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
        warnings += late_warnings(state.lateness[-new:] if new else ())
        if silence := self._silence(now_ns):
            warnings.append(f'no scan for {silence:.1f} s')
        figures = {name: str(count) for name, count in sorted(state.lost.items())}
        figures['Scans published'] = str(state.scans)
        if not state.is_connected or math.isnan(state.latency):
            self._recent.clear()
            return Report(figures, tuple(warnings))
        self._recent.add(now_ns, Counter(scans=state.scans))
        if self._recent.duration >= _RATE_PERIOD:
            rate = self._recent.counts['scans'] / self._recent.duration
            figures['Scan rate'] = f'{rate:.2f} Hz'
            if rate < _LEAST_RATE:
                warnings.append(f'{rate:.1f} scans/s instead of {ROTATION_RATE:g}')
        figures |= {
            'Vendor Name': 'LDROBOT',
            'Motor speed': f'{state.speed:.2f} Hz',
            'Uneven motor': f'{math.degrees(state.uneven):.2f} deg',
            'Computed Latency': f'{state.latency * 1e3:.2f} ms',
            'Clock drift': f'{state.drift_ppm:.1f} ppm',
            'Arrival jitter': f'{state.jitter * 1e3:.2f} ms',
        }
        return Report(figures, tuple(warnings))

    def _silence(self, now_ns: int) -> float:
        """Return how long a connected lidar has not sent a scan [s]; 0 if that is usual."""
        if not self._state.is_connected:
            return 0.0
        silence = (now_ns - self._state.heard_ns) * 1e-9
        return silence if silence > _SILENCE else 0.0
