"""Limits of the nod that keep a band of heights covered at any range.

With fixed limits the height that the beams reach, r tan(phi), shrinks as the robot nears a wall.
Here the limits follow the recent median range r:

    pitch_max = atan((band_top - sensor_height) / r),
    pitch_min = atan((band_bottom - sensor_height) / r).

Each scan has one vote, its median, in the median of a time window: an object that covers less than
half of the view, or stays for less than half of the window, changes nothing. The motion of the
robot is subtracted from every vote at once, so that the window does not lag on a moving robot.
"""

from collections import deque
from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.band import BandConfig
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import NS_PER_S
import numpy as np

WINDOW = 1.6  # s, over which the median of the scans is taken
HYSTERESIS = 0.05  # share by which the range must have changed for the limits to follow
SECTOR = 0.5236  # rad; points up to this azimuth to either side count
LEAST_ADAPTED_SPAN = 0.2  # rad, between the limits at any range
LEAST_POINTS = 10  # a scan with fewer points that count has no vote


@dataclass(frozen=True)
class PitchLimitsConfig(BandConfig, NodConfig):
    """Adaptive limits."""

    adapt_limits: bool = parameter(
        False,
        'Let the limits of the nod follow the median range ahead, so that a band of heights stays '
        'covered; never beyond pitch_min and pitch_max',
        live=True,
    )
    limits_rate: float = parameter(
        1.0,
        'Fastest change of an adapted limit',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )


def limits_at(config: PitchLimitsConfig, distance: float) -> tuple[float, float]:
    """Return the pitch limits [rad] that cover the whole band at a horizontal distance [m].

    They are within the configured ones, and LEAST_ADAPTED_SPAN apart if these are.
    """
    ends = config.band_bottom - config.sensor_height, config.band_top - config.sensor_height
    pitches = (_pitch_of(math.atan2(end, max(distance, 0.0)), config.levelled) for end in ends)
    low, high = sorted(min(max(each, config.pitch_min), config.pitch_max) for each in pitches)
    least = min(LEAST_ADAPTED_SPAN, config.pitch_max - config.pitch_min)
    if high - low >= least:
        return low, high
    low = max(min((low + high - least) / 2.0, config.pitch_max - least), config.pitch_min)
    return low, min(low + least, config.pitch_max)


def _pitch_of(elevation: float, levelled: Array) -> float:
    """Return the pitch at which the middle beam has an elevation, or is nearest to it [rad].

    The beam (cos phi, 0, sin phi) of a tilted mount rises by a cos(phi) + b sin(phi), which is
    hypot(a, b) sin(phi + atan2(a, b)).
    """
    a, _, b = levelled[2].tolist()
    share = math.sin(elevation) / max(math.hypot(a, b), 1e-9)
    turn = math.asin(min(max(share, -1.0), 1.0))
    found = turn - math.atan2(a, b), math.pi - turn - math.atan2(a, b)
    return min((math.remainder(each, math.tau) for each in found), key=abs)


def ranges_that_count(config: PitchLimitsConfig, points: Array) -> Array:
    """Return the horizontal distances [m] of the points in the sector and in the band, shape (m,).

    Points below or above the band, as of floor and ceiling, do not bound the view. Otherwise
    limits that include the floor would shorten the range, and so include yet more of the floor.

    Parameters
    ----------
    config
        The band.
    points
        x forward and y to the left of the sensor, height above the floor [m], shape (n, 3). Those
        that are not finite do not count.
    """
    x, y, height = points[np.isfinite(points).all(axis=1)].T
    ahead = np.abs(np.arctan2(y, x)) <= SECTOR
    counts = ahead & (height > config.band_bottom) & (height < config.band_top)
    return np.asarray(np.hypot(x[counts], y[counts]))


class PitchLimits:
    """Limits that follow the median range; see the module.

    Before the first range they are the widest. Without points they stay.

    Attributes
    ----------
    range
        Median range at the last call of limits [m]; None before the first scan with a vote.
    followed
        Range that the limits follow [m]: `range`, but for the hysteresis.
    """

    def __init__(self, config: PitchLimitsConfig) -> None:
        self.config = config
        self._votes: deque[tuple[int, float]] = deque()
        self._moved = 0.0
        self.range: float | None = None
        self.followed: float | None = None
        self._limits = config.pitch_min, config.pitch_max
        self._time_ns: int | None = None

    def update(self, time_ns: int, ranges: Array) -> None:
        """Add a scan.

        Parameters
        ----------
        time_ns
            When it was taken [ns].
        ranges
            Horizontal distances [m] that count (see ranges_that_count), shape (n,); those that
            are not finite and positive are ignored.

        Raises
        ------
        ParameterError
            If the scan is older than one before it.
        """
        if self._votes and time_ns < self._votes[-1][0]:
            raise ParameterError('time_ns', f'at least {self._votes[-1][0]} ns', time_ns)
        seen = ranges[np.isfinite(ranges) & (ranges > 0.0)]
        if len(seen) >= LEAST_POINTS:
            self._votes.append((time_ns, float(np.median(seen)) + self._moved))

    def add_motion(self, forward: float) -> None:
        """Add a motion of the robot [m]; backward is negative.

        Raises
        ------
        ParameterError
            If it is not finite.
        """
        if not math.isfinite(forward):
            raise ParameterError('forward', 'finite', forward)
        self._moved += forward

    def limits(self, time_ns: int) -> tuple[float, float]:
        """Return the lower and the upper limit [rad] at an instant [ns].

        From call to call a limit changes no faster than the rate.

        Raises
        ------
        ParameterError
            If the instant lies before that of the last call.
        """
        last_ns = time_ns if self._time_ns is None else self._time_ns
        if time_ns < last_ns:
            raise ParameterError('time_ns', f'at least {last_ns} ns', time_ns)
        self._time_ns = time_ns
        self._follow_median(time_ns)
        if self.followed is not None:
            step = self.config.limits_rate * (time_ns - last_ns) / NS_PER_S
            low, high = limits_at(self.config, self.followed)
            # Both limits at one rate: the span is never below that of start and target.
            self._limits = (
                _toward(self._limits[0], low, step),
                _toward(self._limits[1], high, step),
            )
        return self._limits

    def _follow_median(self, time_ns: int) -> None:
        """Follow the median of the votes in the window, if it differs enough from the last one."""
        oldest_ns = time_ns - round(WINDOW * NS_PER_S)
        while self._votes and self._votes[0][0] < oldest_ns:
            self._votes.popleft()
        if not self._votes:
            return
        median = float(np.median([vote for _, vote in self._votes]))
        self.range = max(median - self._moved, 0.0)
        known = self.followed
        if known is None or abs(self.range - known) > HYSTERESIS * known:
            self.followed = self.range


def _toward(value: float, target: float, step: float) -> float:
    """Return the target, or the value nearest to it within one step."""
    return min(max(target, value - step), value + step)
