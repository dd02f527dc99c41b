"""How the driver is doing: what the diagnostics tell."""

from collections import Counter
from dataclasses import dataclass, field
import math

from nodlidar_driver.lidar import Lidar, Scan
from nodlidar_driver.scan import ScanWindow

_RATE_TOLERANCE = 0.75  # a lower share of the expected scans is worth a warning
_DRIFT_WARNING_PPM = 450.0  # beyond this the drift may leave what the estimate can follow
_DROPPED = 'Scans dropped: '
_MISSED = 'Scans missed'
_JUMPS = 'Clock jumps'


@dataclass(frozen=True, slots=True)
class Report:
    """Warnings in words, and figures by name; both empty while no scans come."""

    warnings: list[str] = field(default_factory=list)
    figures: dict[str, str] = field(default_factory=dict)


class Health:
    """Counts over all connections; warnings are about what happened since the last report."""

    def __init__(self, window: ScanWindow) -> None:
        self._window = window
        self._lidar: Lidar | None = None
        self._latency = math.nan
        self._published = 0
        self._earlier: Counter[str] = Counter()
        self._last: Counter[str] = Counter()
        self._last_published = 0
        self._last_ns: int | None = None

    def connected(self, lidar: Lidar) -> None:
        """Take note of a new connection."""
        self._latency = math.nan
        self._lidar = lidar

    def disconnected(self) -> None:
        """Take note that the connection ended."""
        self._earlier = self._counts(self._lidar)
        self._lidar = None

    def published(self, scan: Scan) -> None:
        """Take note of a scan."""
        self._published += 1
        self._latency = (scan.arrival_ns - scan.stamp_ns) * 1e-9

    def report(self, now_ns: int) -> Report:
        """Return how things are at a time [ns], which only serves to compute rates."""
        lidar, rate = self._lidar, self._rate(now_ns)
        counts = self._counts(lidar)
        news = counts - self._last
        self._last, self._last_published = counts, self._published
        if lidar is None or math.isnan(self._latency):
            self._last_ns = None
            return Report()
        self._last_ns = now_ns
        return Report(self._warnings(lidar, news, rate), self._figures(lidar, counts, rate))

    def _rate(self, now_ns: int) -> float:
        """Return the scans per second since the last report; NaN just after connecting."""
        if self._last_ns is None or now_ns <= self._last_ns:
            return math.nan
        return (self._published - self._last_published) * 1e9 / (now_ns - self._last_ns)

    def _counts(self, lidar: Lidar | None) -> Counter[str]:
        """Return what went wrong, counted over all connections."""
        counts = Counter(self._earlier)
        if lidar is not None:
            counts[_MISSED] += lidar.missed
            counts[_JUMPS] += lidar.device_clock.jumps
            for reason, count in lidar.client.drops.items():
                counts[_DROPPED + reason] += count
        return counts

    def _warnings(self, lidar: Lidar, news: Counter[str], rate: float) -> list[str]:
        warnings = [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
        expected = 1.0 / (lidar.capabilities.rotation * (1 + self._window.skip))
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
