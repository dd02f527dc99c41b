"""How the driver is doing: what the diagnostics tell."""

from collections import Counter, deque
from dataclasses import dataclass, field
import math

from nodlidar_driver.lidar import Lidar, Scan
from nodlidar_driver.scan import ScanWindow

_RATE_TOLERANCE = 0.75  # a lower share of the expected scans is worth a warning
_RATE_SCANS = 10  # expected in the time that the rate is taken over: one more or less is no news
_DRIFT_WARNING_PPM = 450.0  # beyond this the drift may leave what the estimate can follow
_DROPPED = 'Scans dropped: '
_MISSED = 'Scans missed'
_JUMPS = 'Clock jumps'


@dataclass(frozen=True, slots=True)
class Report:
    """Warnings in words, and figures by name; both empty while no scans come."""

    warnings: list[str] = field(default_factory=list)
    figures: dict[str, str] = field(default_factory=dict)


class Diagnosis:
    """Counts over all connections; warnings are about what happened since the last report.

    A report may be asked for by another thread than the one that tells what happens.
    """

    def __init__(self, window: ScanWindow) -> None:
        self._window = window
        # The lidar, and what went wrong with those before: always changed together.
        self._connection: tuple[Lidar | None, Counter[str]] = (None, Counter())
        self._latency = math.nan
        self._published = 0
        self._last: Counter[str] = Counter()
        self._reports: deque[tuple[int, int]] = deque()  # time [ns] and scans published by then

    def connected(self, lidar: Lidar) -> None:
        """Take note of a new connection."""
        self._latency = math.nan
        self._connection = (lidar, self._connection[1])

    def disconnected(self) -> None:
        """Take note that the connection ended."""
        self._connection = (None, _counts(*self._connection))

    def published(self, scan: Scan) -> None:
        """Take note of a scan."""
        self._published += 1
        self._latency = (scan.arrival_ns - scan.stamp_ns) * 1e-9

    def report(self, now_ns: int) -> Report:
        """Return how things are at a time [ns], which only serves to compute rates."""
        lidar, earlier = self._connection
        counts = _counts(lidar, earlier)
        news = counts - self._last
        self._last = counts
        if lidar is None or math.isnan(self._latency):
            self._reports.clear()
            return Report()
        rate = self._rate(now_ns, self._scan_period(lidar))
        return Report(self._warnings(lidar, news, rate), self._figures(lidar, counts, rate))

    def _scan_period(self, lidar: Lidar) -> float:
        """Return the time from scan to scan [s]."""
        return lidar.capabilities.rotation * (1 + self._window.skip)

    def _rate(self, now_ns: int, scan_period: float) -> float:
        """Return the scans per second of the last scans; NaN just after connecting."""
        reports, published = self._reports, self._published
        reports.append((now_ns, published))
        long_ago_ns = now_ns - round(_RATE_SCANS * scan_period * 1e9)
        while len(reports) > 1 and reports[1][0] <= long_ago_ns:
            reports.popleft()
        then_ns, by_then = reports[0]
        if then_ns > long_ago_ns:
            return math.nan
        return (published - by_then) * 1e9 / (now_ns - then_ns)

    def _warnings(self, lidar: Lidar, news: Counter[str], rate: float) -> list[str]:
        warnings = [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
        expected = 1.0 / self._scan_period(lidar)
        if rate < _RATE_TOLERANCE * expected:
            warnings.append(f'{rate:.1f} scans/s instead of {expected:.1f}')
        if not lidar.device_clock.synchronised:
            warnings.append('time mode told nothing usable: stamps may be off by some 10 ms')
        if abs(lidar.device_clock.drift_ppm) > _DRIFT_WARNING_PPM:
            warnings.append(f'clock drift {lidar.device_clock.drift_ppm:.0f} ppm')
        return warnings

    def _figures(self, lidar: Lidar, counts: Counter[str], rate: float) -> dict[str, str]:
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
            'Scans published': str(self._published),
            'Clock drift': f'{lidar.device_clock.drift_ppm:.1f} ppm',
            'Arrival jitter': f'{lidar.device_clock.jitter * 1e3:.2f} ms',
            **{name: str(count) for name, count in sorted(counts.items())},
        }


def _counts(lidar: Lidar | None, earlier: Counter[str]) -> Counter[str]:
    """Return what went wrong with a lidar and earlier ones."""
    counts = Counter(earlier)
    if lidar is not None:
        counts[_MISSED] += lidar.missed
        counts[_JUMPS] += lidar.device_clock.jumps
        for reason, count in list(lidar.client.drops.items()):  # the device's thread adds to it
            counts[_DROPPED + reason] += count
    return counts
