"""A level scan of the last sweep: per azimuth, the nearest range in a band of heights.

Every beam crosses the band of heights on one segment, from where it enters the band to where it
leaves it or ends. A segment that ends at a surface in the band is a hit. A segment that crosses
the circle of level_scan_free has seen that azimuth free. All are as of one instant: where the
robot, by odometry, would have seen them from its pose at that instant.

One beam that passes makes an azimuth free, so rows that were not seen could hide what is there.
Therefore there is no level scan of a sweep that misses scans, or that turned back before the ends
of the sweeps before it, and none while the nod rests. Nor is there one of a sweep in which no beam
hit anything, as of a lidar that is covered.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math
from statistics import median_low
from typing import Any

from nodlidar_assembler.clouds.band_segments import Segments, segments_in_band
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig, ranges_of
from nodlidar_assembler.clouds.pipeline import Assembled, LONGEST_SWEEP
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.clouds.sweeps import MOST_SCANS
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np
from numpy.typing import NDArray

# Reversals are searched for in the pitch of one beam of this many: 11 per scan of a URG-04LX.
_THINNED = 64
# A beam that returns nothing is followed for this many times level_scan_range, or to range_max.
_REACH = 10.0
# The usual interval of scans is the median of the last ones. One that is this many times as long
# leaves out two rows or more.
_INTERVALS, _LONGEST_INTERVAL = 21, 2.5
# A sweep that takes less than this share of the one before is its return, with few rows.
_RETURN = 0.5
# A nod without a reversal for this many times what it took before, and is commanded to, rests.
_RESTS = 2
# A sweep that lacks more than this share of the span of this and the sweeps before turned back
# between its limits. After this many, narrower limits are taken for the nod's.
_LACKING, _SWEEPS = 0.1, 3


@dataclass(frozen=True, slots=True, eq=False)
class LevelScan:
    """Ranges by azimuth as of one instant.

    Attributes
    ----------
    stamp_ns
        That instant: of the last beam [ns].
    duration
        Of the sweep [s].
    ranges
        Distances from the nod axis in the plane [m], shape (level_scan_beams,); +inf where a beam
        in the band passed level_scan_free and none hit, NaN where the band was not seen.
    """

    stamp_ns: int
    duration: float
    ranges: NDArray[np.float32]


def message_fields(scan: LevelScan, config: LevelScanConfig, range_min: float) -> dict[str, Any]:
    """Return the fields of a LaserScan, but for header, ranges and intensities."""
    last = (config.level_scan_beams - 1) * config.increment
    return {
        'angle_min': -config.level_scan_angle,
        'angle_max': last - config.level_scan_angle,
        'angle_increment': config.increment,
        'time_increment': 0.0,  # all beams are of one instant
        'scan_time': scan.duration,
        'range_min': range_min,
        'range_max': config.level_scan_range,
    }


@dataclass(frozen=True, slots=True)
class _Sweep:
    """How long a sweep took [ns], and from where to where it went [rad]."""

    duration_ns: int
    low: float
    high: float


def level_frame(frame_id: str, config: LevelScanConfig) -> str:
    """Return the frame of level scans: that of the clouds, unless it is tilted on the robot."""
    return f'{frame_id}_level' if any(config.mount_tilt) else frame_id


class LevelScanner:
    """Keeps the beams of the last sweep and makes level scans of them.

    Parameters
    ----------
    config
        Band of heights, and shape of the level scan.

    Attributes
    ----------
    commanded_ns
        How long a sweep of the commanded nod takes [ns]; 0 if that is not known.
    """

    def __init__(self, config: LevelScanConfig) -> None:
        self._config = config
        axis = config.axis_height(config.laser_xyz)
        self._band = config.band_bottom - axis, config.band_top - axis
        self._levelled = config.levelled
        self.commanded_ns = 0
        self._stamp_ns = 0
        self._intervals_ns: deque[int] = deque(maxlen=_INTERVALS)
        self.restart()

    def restart(self) -> None:
        """Forget all beams, as after the clock was set."""
        self._reversals = ReversalFinder()
        self._scans: deque[Segments] = deque(maxlen=MOST_SCANS)
        self._last_reversal_ns: int | None = None
        self._begin_ns: int | None = None  # of the last whole sweep, or of the one that it returns
        self._reached = math.inf, -math.inf  # lowest and highest pitch since the last reversal
        self._sweeps: deque[_Sweep] = deque(maxlen=_SWEEPS)
        self._newest_ns = 0
        self._hit_ns = 0  # the end of the last scan with a range

    def add(self, assembled: Assembled) -> list[LevelScan]:
        """Add a scan, if it is newer; return the level scans that it completes."""
        scan, beams = assembled.scan, assembled.beams
        times_ns = scan.stamp_ns + beams.offset_ns
        if assembled.jumped or times_ns[-1] < self._newest_ns - TIME_JUMP_NS:
            self.restart()
        if times_ns[-1] <= self._newest_ns and self._scans:
            return []
        if self._misses_scans(scan.stamp_ns) or self._rests(int(times_ns[-1])):
            self.restart()
        # The first beams of a scan may be stamped before the last ones of the scan before.
        times_ns = np.maximum(times_ns, self._newest_ns)
        self._newest_ns = int(times_ns[-1])
        if len(assembled.placed.indices):
            self._hit_ns = self._newest_ns
        self._scans.append(self._in_band(assembled))
        level_scans = []
        for k in range(0, len(times_ns), _THINNED):
            pitch = float(assembled.pitch[k])
            low, high = self._reached
            self._reached = min(low, pitch), max(high, pitch)
            reversal_ns = self._reversals.add(int(times_ns[k]), pitch)
            if reversal_ns is not None:
                level_scans += self._swept(reversal_ns, pitch)
        if self._config.level_scan == 'scan':
            level_scans = self._since_sweep()
        self._forget()
        return level_scans

    def _misses_scans(self, stamp_ns: int) -> bool:
        """Return whether scans are missing before one with a stamp [ns]."""
        interval_ns, self._stamp_ns = stamp_ns - self._stamp_ns, stamp_ns
        if not self._newest_ns:
            return False
        self._intervals_ns.append(interval_ns)
        return interval_ns > _LONGEST_INTERVAL * median_low(self._intervals_ns)

    def _rests(self, now_ns: int) -> bool:
        """Return whether the nod has not turned back for long at an instant [ns]."""
        if self._last_reversal_ns is None or not self._is_known:
            return False
        longest_ns = max(self.commanded_ns, *(sweep.duration_ns for sweep in self._sweeps))
        return now_ns - self._last_reversal_ns > _RESTS * longest_ns

    def _swept(self, reversal_ns: int, pitch: float) -> list[LevelScan]:
        """Return the level scan of the sweep that a reversal ended, if all of it was seen.

        The reversal was found a little later, at a pitch that is still near to its own.
        """
        begin_ns, self._last_reversal_ns = self._last_reversal_ns, reversal_ns
        low, high = self._reached
        self._reached = (pitch, high) if high - pitch < pitch - low else (low, pitch)
        if begin_ns is None or not begin_ns < reversal_ns:
            return []
        sweep = _Sweep(reversal_ns - begin_ns, low, high)
        before_ns = self._sweeps[-1].duration_ns if self._sweeps else 0
        is_return = sweep.duration_ns < _RETURN * before_ns
        self._sweeps.append(sweep)
        if not self._is_whole(sweep):
            return []
        if self._begin_ns is None or not is_return:
            self._begin_ns = begin_ns
        return self._of(self._begin_ns, reversal_ns) if self._is_known else []

    @property
    def _is_known(self) -> bool:
        """Whether two sweeps have shown how far and how long the nod goes."""
        return len(self._sweeps) > 1

    def _is_whole(self, sweep: _Sweep) -> bool:
        """Return whether a sweep went as far as the ones before it."""
        low, high = min(each.low for each in self._sweeps), max(each.high for each in self._sweeps)
        lacking = _LACKING * (high - low)
        return sweep.low <= low + lacking and sweep.high >= high - lacking

    def _since_sweep(self) -> list[LevelScan]:
        """Return the level scan of the last whole sweep and of the beams since.

        Back to the same point of that sweep would not do: in the middle of the nod, these are
        twice the rows of one half.
        """
        if self._begin_ns is None or not self._is_known:
            return []
        return self._of(self._begin_ns, self._newest_ns)

    def _forget(self) -> None:
        """Forget the scans before the sweep that is needed next."""
        known = (self._begin_ns, self._last_reversal_ns, self._newest_ns)
        needed_ns = next(each for each in known if each is not None)
        needed_ns = max(needed_ns, self._newest_ns - round(LONGEST_SWEEP * NS_PER_S))
        while self._scans and not self._ends_after(self._scans[0], needed_ns):
            self._scans.popleft()

    @staticmethod
    def _ends_after(segments: Segments, time_ns: int) -> bool:
        return len(segments.time_ns) > 0 and int(segments.time_ns[-1]) >= time_ns

    def _in_band(self, assembled: Assembled) -> Segments:
        config = self._config
        reach = _REACH * config.level_scan_range
        free = config.lost_beams_are_free
        return segments_in_band(assembled, self._band, reach, free, self._levelled)

    def _of(self, begin_ns: int, end_ns: int) -> list[LevelScan]:
        """Return the level scan of the beams after one instant, up to another [ns]."""
        if end_ns - begin_ns > LONGEST_SWEEP * NS_PER_S:
            return []  # the first of them are forgotten
        if self._hit_ns <= begin_ns:
            return []
        segments = Segments.joined([each.between(begin_ns, end_ns) for each in self._scans])
        if not len(segments.time_ns):
            return []
        ranges = ranges_of(*segments.in_plane(), segments.hit, self._config)
        duration = (end_ns - begin_ns) / NS_PER_S
        return [LevelScan(int(segments.time_ns[-1]), duration, ranges)]
