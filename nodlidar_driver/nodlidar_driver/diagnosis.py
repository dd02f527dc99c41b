"""How the driver is doing: what the diagnostics tell."""

from collections import Counter, deque
from dataclasses import dataclass, field
import math

from nodlidar_common.host_time import HostTime
from nodlidar_driver.lidar import Lidar, Scan
from nodlidar_driver.scan import ScanWindow
from nodlidar_driver.scan_account import MISSED, ScanAccount, SETTLING

_RATE_TOLERANCE = 0.75  # a lower share of the expected scans is worth a warning
_RATE_SCANS = 10  # expected in the time that the rate is taken over: one more or less is no news
_DRIFT_WARNING_PPM = 450.0  # beyond this the drift may leave what the estimate can follow
_LATE_WARNING = 0.01  # s; a scan that is later waited for the host or in the line
_MEAN_LATE_WARNING = 0.002  # s; scans that are later on average do so again and again
_SILENCE, _SILENCE_PERIODS = 0.5, 2.5  # s and scans, whichever is longer, without any
_CLOCK_STEPS = 'Host clock steps'


@dataclass(frozen=True, slots=True)
class Report:
    """Warnings in words, and figures by name."""

    warnings: list[str] = field(default_factory=list)
    figures: dict[str, str] = field(default_factory=dict)


class Diagnosis:
    """Counts over all connections; warnings are about what happened since the last report.

    A report may be asked for by another thread than the one that tells what happens.

    Parameters
    ----------
    window
        The beams of a scan.
    host_time
        Knows when the host's clock was set.

    Attributes
    ----------
    account
        What became of each scan.
    """

    def __init__(self, window: ScanWindow, host_time: HostTime) -> None:
        self.account = ScanAccount()
        self._window = window
        self._host_time = host_time
        self._lidar: Lidar | None = None
        self._latency = math.nan
        self._lateness: list[float] = []  # of the scans since the last report [s]
        self._late_scans = 0
        self._heard_ns = 0
        self._last: Counter[str] = self._counts()
        self._reports: deque[tuple[int, int]] = deque()  # time [ns] and scans published by then

    def connected(self, lidar: Lidar, now_ns: int) -> None:
        """Take note of a new connection at a time [ns]."""
        self._latency, self._heard_ns = math.nan, now_ns
        self._lidar = lidar

    def disconnected(self) -> None:
        """Take note that the connection ended."""
        self._lidar = None

    def published(self, scan: Scan) -> None:
        """Take note of a scan."""
        self._lateness.append(scan.late)
        self._late_scans += scan.late > _LATE_WARNING
        self._latency = (scan.arrival_ns - scan.stamp_ns) * 1e-9
        self._heard_ns = scan.arrival_ns

    def urgent(self, now_ns: int) -> tuple[object, ...]:
        """Return what is to be reported at once when it is another at a time [ns]."""
        lost = self.account.lost.total() - self.account.lost[SETTLING]
        return self._silence(now_ns) > 0.0, lost, self._late_scans, self._host_time.steps

    def report(self, now_ns: int) -> Report:
        """Return how things are at a time [ns] by the clock of the scans' arrival."""
        lidar, counts = self._lidar, self._counts()
        news, self._last = counts - self._last, counts
        lateness, self._lateness = self._lateness, []
        late = max(lateness, default=0.0)
        warnings = self._news(news) + _late_warnings(lateness)
        if silence := self._silence(now_ns):
            warnings.append(f'no scan for {silence:.1f} s')
        figures = {name: str(count) for name, count in counts.items()}
        figures['Scans due'] = str(self.account.due)
        figures['Scans published'] = str(self.account.published)
        if lidar is None or math.isnan(self._latency):
            self._reports.clear()
            return Report(warnings, figures)
        rate = self._rate(now_ns, self._scan_period(lidar))
        warnings += self._warnings(lidar, rate)
        return Report(warnings, figures | self._figures(lidar, rate, late))

    def _silence(self, now_ns: int) -> float:
        """Return for how long a connected lidar has not sent a scan [s]; 0 if that is usual."""
        lidar, silence = self._lidar, (now_ns - self._heard_ns) * 1e-9
        if lidar is None:
            return 0.0
        usual = max(_SILENCE, _SILENCE_PERIODS * self._scan_period(lidar))
        return silence if silence > usual else 0.0

    def _counts(self) -> Counter[str]:
        """Return what went wrong so far."""
        lost = self.account.lost
        names = {name: f'Scans dropped: {name}' for name in lost} | {MISSED: 'Scans missed'}
        counts = Counter({names[reason]: count for reason, count in lost.items()})
        counts[_CLOCK_STEPS] = self._host_time.steps
        return counts

    def _scan_period(self, lidar: Lidar) -> float:
        """Return the time from scan to scan [s]."""
        return lidar.capabilities.rotation * (1 + self._window.skip)

    def _rate(self, now_ns: int, scan_period: float) -> float:
        """Return the scans per second of the last scans; NaN just after connecting."""
        reports, published = self._reports, self.account.published
        reports.append((now_ns, published))
        long_ago_ns = now_ns - round(_RATE_SCANS * scan_period * 1e9)
        while len(reports) > 1 and reports[1][0] <= long_ago_ns:
            reports.popleft()
        then_ns, by_then = reports[0]
        if then_ns > long_ago_ns:
            return math.nan
        return (published - by_then) * 1e9 / (now_ns - then_ns)

    def _news(self, news: Counter[str]) -> list[str]:
        """Return warnings of what happened since the last report."""
        del news[f'Scans dropped: {SETTLING}']  # each stream begins so
        stepped = news.pop(_CLOCK_STEPS, 0)
        warnings = [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
        if stepped:
            warnings.append(f"the host's clock was set by {self._host_time.last_step_ns / 1e9} s")
        return warnings

    def _warnings(self, lidar: Lidar, rate: float) -> list[str]:
        warnings = []
        expected = 1.0 / self._scan_period(lidar)
        if rate < _RATE_TOLERANCE * expected:
            warnings.append(f'{rate:.1f} scans/s instead of {expected:.1f}')
        if not lidar.device_clock.synchronised:
            warnings.append('time mode told nothing usable: stamps may be off by some 10 ms')
        if abs(lidar.device_clock.drift_ppm) > _DRIFT_WARNING_PPM:
            warnings.append(f'clock drift {lidar.device_clock.drift_ppm:.0f} ppm')
        return warnings

    def _figures(self, lidar: Lidar, rate: float, late: float) -> dict[str, str]:
        """Return the figures, by the names of REP 138 where it has one."""
        return {
            'Vendor Name': lidar.version.vendor,
            'Product Name': lidar.version.product,
            'Firmware Version': lidar.version.firmware,
            'Protocol Version': lidar.version.protocol,
            'Device ID': lidar.version.serial_number,
            'Device Status': lidar.state.health,
            'Motor speed': lidar.state.speed,
            'Computed Latency': f'{self._latency * 1e3:.2f} ms',
            'Scan rate': f'{rate:.2f} Hz',
            'Clock drift': f'{lidar.device_clock.drift_ppm:.1f} ppm',
            'Arrival jitter': f'{lidar.device_clock.jitter * 1e3:.2f} ms',
            'Latest arrival': f'{late * 1e3:.1f} ms late',
        }


def _late_warnings(lateness: list[float]) -> list[str]:
    """Return a warning if scans waited, as their lateness [s] tells."""
    late = max(lateness, default=0.0)
    if late > _LATE_WARNING or (lateness and sum(lateness) / len(lateness) > _MEAN_LATE_WARNING):
        return [f'scans came up to {late:.2g} s late; their stamps are right']
    return []
