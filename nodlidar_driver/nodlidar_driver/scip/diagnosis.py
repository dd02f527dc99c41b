"""What the driver reports about the lidar and its scans."""

from collections import Counter
from copy import deepcopy
from dataclasses import replace
import math
from typing import Any

from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_driver.scip.lidar import Lidar, Scan
from nodlidar_driver.scip.scan_account import MISSED, ScanAccount, SETTLING
from nodlidar_driver.scip.state import LidarState, Link

_RATE_TOLERANCE = 0.75  # a lower share of the expected scans is worth a warning
# Expected in the time over which the rate is taken: one more or less does not matter.
_RATE_SCANS = 10
_DRIFT_WARNING_PPM = 450.0  # beyond this the drift may leave the range of the estimate
_LATE_WARNING = 0.01  # s; a scan that is later waited for the host or in the line
_MEAN_LATE_WARNING = 0.002  # s; scans that are later on average do so again and again
_SILENCE, _SILENCE_PERIODS = 0.5, 2.5  # s and scans, whichever is longer, without any
_REMEMBERED = 600  # scans whose lateness is kept for the next report
_CLOCK_STEPS = 'Host clock steps'


class Diagnosis:
    """Reports the lidar's state; counts are over all connections.

    The device's thread calls `connected`, `published`, `clock_set` and `disconnected`, the thread
    of the diagnostics `urgent` and `next_report`. Only a :class:`LidarState` goes from one to the
    other.

    Parameters
    ----------
    skip
        Scans left out after each sent one.
    account
        Counts the scans; read in the device's thread only.
    """

    def __init__(self, skip: int, account: ScanAccount) -> None:
        self._periods = 1 + skip
        self._account = account
        self._lidar: Lidar | None = None
        self._state = self._reported = LidarState(deepcopy(account))
        self._recent: Recent | None = None

    # The device's thread.

    def connected(self, lidar: Lidar, now_ns: int) -> None:
        """Report about this lidar from a time [ns] on."""
        self._lidar = lidar
        self._update(latency=math.nan, heard_ns=now_ns)

    def published(self, scan: Scan) -> None:
        """Count a scan that was published."""
        state = self._state
        self._update(
            heard_ns=scan.arrival_ns,
            latency=(scan.arrival_ns - scan.stamp_ns) * 1e-9,
            scans=state.scans + 1,
            late_scans=state.late_scans + (scan.late > _LATE_WARNING),
            lateness=(*state.lateness[1 - _REMEMBERED :], scan.late),
        )

    def clock_set(self, step_ns: int) -> None:
        """Count a step of the host's clock [ns]; 0 is none."""
        if step_ns:
            self._update(clock_steps=self._state.clock_steps + 1, last_clock_step=step_ns / 1e9)

    def disconnected(self) -> None:
        """Report only the counts until connected again."""
        self._lidar = None
        self._update()

    def _update(self, **changes: Any) -> None:
        self._state = replace(
            self._state,
            account=deepcopy(self._account),
            link=Link.of(self._lidar) if self._lidar else None,
            **changes,
        )

    # The thread of the diagnostics.

    def urgent(self, now_ns: int) -> tuple[object, ...]:
        """Return silence and the counts of what went wrong, at a time [ns]."""
        state = self._state
        lost = state.account.lost.total() - state.account.lost[SETTLING]
        return self._silence(state, now_ns) > 0.0, lost, state.late_scans, state.clock_steps

    def next_report(self, now_ns: int) -> Report:
        """Return the state at a time [ns] by the clock of the scans' arrival.

        Warnings are about what happened since the last report.
        """
        state, before = self._state, self._reported
        self._reported = state
        new = state.scans - before.scans
        lateness = state.lateness[-new:] if new else ()
        warnings = _news(state, before) + late_warnings(lateness)
        if silence := self._silence(state, now_ns):
            warnings.append(f'no scan for {silence:.1f} s')
        figures = {name: str(count) for name, count in _counts(state).items()}
        figures['Scans due'] = str(state.account.due)
        figures['Scans published'] = str(state.account.published)
        if state.link is None or math.isnan(state.latency):
            self._recent = None
            return Report(figures, tuple(warnings))
        expected = 1.0 / self._scan_period(state.link)
        rate = self._rate(state.account.published, now_ns, expected)
        warnings += _link_warnings(state.link, rate, expected)
        figures |= _link_figures(state.link, rate, state.latency, max(lateness, default=0.0))
        return Report(figures, tuple(warnings))

    def _silence(self, state: LidarState, now_ns: int) -> float:
        """Return how long a connected lidar has not sent a scan [s]; 0 if that is usual."""
        if state.link is None:
            return 0.0
        silence = (now_ns - state.heard_ns) * 1e-9
        usual = max(_SILENCE, _SILENCE_PERIODS * self._scan_period(state.link))
        return silence if silence > usual else 0.0

    def _scan_period(self, link: Link) -> float:
        """Return the time from scan to scan [s]."""
        return link.capabilities.revolution * self._periods

    def _rate(self, published: int, now_ns: int, expected: float) -> float:
        """Return the recent scans per second; NaN just after connecting."""
        window = _RATE_SCANS / expected
        if self._recent is None:
            self._recent = Recent(window)
        self._recent.add(now_ns, Counter(published=published))
        duration = self._recent.duration
        if duration < window:
            return math.nan
        return self._recent.counts['published'] / duration


def _counts(state: LidarState) -> Counter[str]:
    """Return what went wrong so far."""
    lost = state.account.lost
    names = {name: f'Scans dropped: {name}' for name in lost} | {MISSED: 'Scans missed'}
    counts = Counter({names[reason]: count for reason, count in lost.items()})
    counts[_CLOCK_STEPS] = state.clock_steps
    return counts


def _news(state: LidarState, before: LidarState) -> list[str]:
    """Return warnings of what went wrong between two states."""
    news = _counts(state) - _counts(before)
    del news[f'Scans dropped: {SETTLING}']  # each stream begins so
    stepped = news.pop(_CLOCK_STEPS, 0)
    warnings = [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
    if stepped:
        warnings.append(f"the host's clock was set by {state.last_clock_step} s")
    return warnings


def late_warnings(lateness: tuple[float, ...]) -> list[str]:
    """Return a warning if scans waited, as their lateness [s] shows."""
    late = max(lateness, default=0.0)
    if late > _LATE_WARNING or (lateness and sum(lateness) / len(lateness) > _MEAN_LATE_WARNING):
        return [f'scans came up to {late:.2g} s late; their stamps are right']
    return []


def _link_warnings(link: Link, rate: float, expected: float) -> list[str]:
    warnings = []
    if rate < _RATE_TOLERANCE * expected:
        warnings.append(f'{rate:.1f} scans/s instead of {expected:.1f}')
    if not link.is_synchronised:
        warnings.append('no usable answers in time mode: stamps may be off by some 10 ms')
    if abs(link.drift_ppm) > _DRIFT_WARNING_PPM:
        warnings.append(f'clock drift {link.drift_ppm:.0f} ppm')
    return warnings


def _link_figures(link: Link, rate: float, latency: float, late: float) -> dict[str, str]:
    """Return the figures, by the names of REP 138 where it has one."""
    return {
        'Vendor Name': link.version.vendor,
        'Product Name': link.version.product,
        'Firmware Version': link.version.firmware,
        'Protocol Version': link.version.protocol,
        'Device ID': link.version.serial_number,
        'Device Status': link.state.health,
        'Motor speed': link.state.speed,
        'Computed Latency': f'{latency * 1e3:.2f} ms',
        'Scan rate': f'{rate:.2f} Hz',
        'Clock drift': f'{link.drift_ppm:.1f} ppm',
        'Arrival jitter': f'{link.jitter * 1e3:.2f} ms',
        'Latest arrival': f'{late * 1e3:.1f} ms late',
    }
