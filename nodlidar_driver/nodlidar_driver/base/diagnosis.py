"""What the drivers report about their lidars and scans."""

from collections import Counter
from dataclasses import replace
from typing import Any

from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_driver.base.state import LidarState

_RATE_TOLERANCE = 0.75  # a lower share of the expected scans is worth a warning
# Expected in the time over which the rate is taken: one more or less does not matter.
_RATE_SCANS = 10
_LATE_WARNING = 0.01  # s; a scan that is later waited for the host or in the line
_MEAN_LATE_WARNING = 0.002  # s; scans that are later on average do so again and again
_SILENCE, _SILENCE_PERIODS = 0.5, 2.5  # s and scans, whichever is longer, without any
_REMEMBERED = 600  # scans whose lateness is kept for the next report


class LidarDiagnosis:
    """Reports a lidar's state; counts are over all connections.

    The device's thread calls `connected`, `published`, `clock_set` and `disconnected`, the thread
    of the diagnostics `urgent` and `next_report`. Only a :class:`.LidarState` goes from one to the
    other. Subclasses say what is known of their lidar.

    Attributes
    ----------
    usual
        Name of what may be lost without a warning.
    """

    usual = ''

    def __init__(self) -> None:
        self._lidar: Any = None
        self._state = self._reported = LidarState()
        self._recent: Recent | None = None

    # The device's thread.

    def connected(self, lidar: Any, now_ns: int) -> None:
        """Report about this lidar from a time [ns] on."""
        self._lidar = lidar
        self._update(scan=None, heard_ns=now_ns)

    def published(self, scan: Any) -> None:
        """Count a scan that was published."""
        state = self._state
        self._update(
            heard_ns=scan.arrival_ns,
            scan=scan,
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

    def lost(self) -> Counter[str]:
        """Return what was lost so far, by name; a new object."""
        raise NotImplementedError

    def link_to(self, lidar: Any) -> Any:
        """Return what is known of a connected lidar, a :class:`.Link`."""
        raise NotImplementedError

    def _update(self, **changes: Any) -> None:
        link = None if self._lidar is None else self.link_to(self._lidar)
        self._state = replace(self._state, lost=self.lost(), link=link, **changes)

    # The thread of the diagnostics.

    def urgent(self, now_ns: int) -> tuple[object, ...]:
        """Return silence and the counts of what went wrong, at a time [ns]."""
        state = self._state
        lost = state.lost.total() - state.lost[self.usual]
        return self._silence(state, now_ns) > 0.0, lost, state.late_scans, state.clock_steps

    def next_report(self, now_ns: int) -> Report:
        """Return the state at a time [ns] by the clock of the scans' arrival.

        Warnings are about what happened since the last report.
        """
        state, before = self._state, self._reported
        self._reported = state
        new = state.scans - before.scans
        lateness = state.lateness[-new:] if new else ()
        warnings = self._news(state, before) + _late_warnings(lateness)
        if silence := self._silence(state, now_ns):
            warnings.append(f'no scan for {silence:.1f} s')
        figures = {name: str(count) for name, count in sorted(state.lost.items())}
        figures['Host clock steps'] = str(state.clock_steps)
        figures['Scans published'] = str(state.scans)
        link, scan = state.link, state.scan
        if link is None or scan is None:
            self._recent = None
            return Report(figures, tuple(warnings))
        expected = self.expected_rate(link)
        rate = self._rate(state.scans, now_ns, expected)
        if rate is not None:
            figures['Scan rate'] = f'{rate:.2f} Hz'
            if rate < _RATE_TOLERANCE * expected:
                warnings.append(f'{rate:.1f} scans/s instead of {expected:.1f}')
        warnings += self.link_warnings(link)
        figures |= self.link_figures(link, scan) | {
            'Computed Latency': f'{(scan.arrival_ns - scan.stamp_ns) * 1e-6:.2f} ms',
            'Clock drift': f'{link.drift_ppm:.1f} ppm',
            'Arrival jitter': f'{link.jitter * 1e3:.2f} ms',
            'Latest arrival': f'{max(lateness, default=0.0) * 1e3:.1f} ms late',
        }
        return Report(figures, tuple(warnings))

    def expected_rate(self, link: Any) -> float:
        """Return how many scans per second a lidar should send."""
        raise NotImplementedError

    def link_warnings(self, link: Any) -> list[str]:
        """Return what is unusual about a connected lidar."""
        return []

    def link_figures(self, link: Any, scan: Any) -> dict[str, str]:
        """Return what a connected lidar is, by the names of REP 138, from its latest scan, too."""
        raise NotImplementedError

    def _news(self, state: LidarState, before: LidarState) -> list[str]:
        """Return warnings of what went wrong between two states."""
        news = state.lost - before.lost
        del news[self.usual]
        warnings = [f'{name.lower()}: {count} more' for name, count in sorted(news.items())]
        if state.clock_steps > before.clock_steps:
            warnings.append(f"the host's clock was set by {state.last_clock_step} s")
        return warnings

    def _silence(self, state: LidarState, now_ns: int) -> float:
        """Return how long a connected lidar has not sent a scan [s]; 0 if that is usual."""
        if state.link is None:
            return 0.0
        silence = (now_ns - state.heard_ns) * 1e-9
        usual = max(_SILENCE, _SILENCE_PERIODS / self.expected_rate(state.link))
        return silence if silence > usual else 0.0

    def _rate(self, scans: int, now_ns: int, expected: float) -> float | None:
        """Return the recent scans per second; None just after connecting."""
        window = _RATE_SCANS / expected
        if self._recent is None:
            self._recent = Recent(window)
        self._recent.add(now_ns, Counter(scans=scans))
        duration = self._recent.duration
        return self._recent.counts['scans'] / duration if duration >= window else None


def _late_warnings(lateness: tuple[float, ...]) -> list[str]:
    """Return a warning if scans waited, as their lateness [s] shows."""
    late = max(lateness, default=0.0)
    if late > _LATE_WARNING or (lateness and sum(lateness) / len(lateness) > _MEAN_LATE_WARNING):
        return [f'scans came up to {late:.2g} s late; their stamps are right']
    return []
