"""Ranges by azimuth, from beams in the plane: the nearest surface, free or not seen."""

from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.band import BandConfig
from nodlidar_assembler.clouds.geometry import LaserPoseConfig
from nodlidar_assembler.clouds.point_sigma import SigmaConfig
from nodlidar_common.arrays import Array, Mask
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray

LEVEL_SCANS = ('off', 'sweep', 'scan')
# Hits this many standard deviations behind the nearest of an azimuth are of the same surface, and
# averaged: the nearest alone would be too near by the noise, of a few hits by about half of this.
SAME_SURFACE = 4.0


@dataclass(frozen=True)
class LevelScanConfig(LaserPoseConfig, BandConfig, SigmaConfig):
    """Level scan."""

    level_scan: str = parameter(
        'off',
        'Publish level_scan, a LaserScan in frame_id, or with mount_tilt in a level frame, of the '
        'beams of the last sweep in the band of heights: once per sweep, or with each scan',
        choices=LEVEL_SCANS,
    )
    level_scan_range: float = parameter(
        5.0,
        'range_max of level_scan; hits farther away do not count',
        unit='m',
        minimum=0.1,
        maximum=1000.0,
    )
    level_scan_free: float = parameter(
        2.0,
        'An azimuth of level_scan without a hit is +inf if a beam in the band passed this '
        'distance. No more than the distance at which the lidar loses black things, less what the '
        'robot drives in a sweep, since a lost beam (NaN) passes it',
        unit='m',
        minimum=0.1,
        maximum=1000.0,
    )
    level_scan_angle: float = parameter(
        1.92,
        'level_scan is from minus to plus this azimuth',
        unit='rad',
        minimum=0.1,
        maximum=math.pi,
    )
    level_scan_beams: int = parameter(
        441,
        'Number of azimuths of level_scan',
        minimum=2,
        maximum=10_000,
    )
    beam_width: float = parameter(
        0.01,
        'Angle of the cone that a beam is; an azimuth of level_scan that no middle of a beam '
        'saw is known from beams whose edge saw it. URG-04LX-UG01: 40 mm at 4 m',
        unit='rad',
        minimum=0.0,
        maximum=0.1,
    )
    lost_beams_are_free: bool = parameter(
        True,
        'Count beams that the lidar lost (NaN) as free up to level_scan_free, like those that '
        'return nothing in range: false if black things matter more than azimuths not seen',
    )

    def check_together(self) -> None:
        """Raise ParameterError if free azimuths could hide hits that count."""
        if self.level_scan_free > self.level_scan_range:
            limit = f'at most level_scan_range = {self.level_scan_range} m'
            raise ParameterError('level_scan_free', limit, self.level_scan_free)

    @property
    def increment(self) -> float:
        """Step between azimuths [rad]; the last of a full circle is one step before the first."""
        beams = self.level_scan_beams if self.is_full_circle else self.level_scan_beams - 1
        return 2.0 * self.level_scan_angle / beams

    @property
    def is_full_circle(self) -> bool:
        """Whether it goes all around."""
        return self.level_scan_angle > math.pi - 1e-6


def ranges_of(begin: Array, end: Array, hit: Mask, config: LevelScanConfig) -> NDArray[np.float32]:
    """Return the ranges of a level scan [m], shape (level_scan_beams,).

    Parameters
    ----------
    begin, end
        Where beams enter the band, and leave it or end, in the plane [m], shape (n, 2) each.
    hit
        Whether they end at a surface in the band, shape (n,).
    config
        Shape of the level scan.
    """
    passed = _crossings(begin, end, config.level_scan_free)
    near = end[hit & (np.hypot(*end.T) <= config.level_scan_range)]
    middle, left, right = (
        _nearest(passed, near, config, side * config.beam_width / 2.0) for side in (0, -1, 1)
    )
    return np.where(np.isnan(middle), np.fmin(left, right), middle)


def _nearest(
    passed: Array, hits: Array, config: LevelScanConfig, turn: float
) -> NDArray[np.float32]:
    """Return the ranges where points in the plane are passed and hit, by azimuth plus a turn."""
    ranges = np.full(config.level_scan_beams, np.nan, dtype=np.float32)
    free, known = _bins(passed, config, turn)
    ranges[free[known]] = np.inf
    bins, known = _bins(hits, config, turn)
    bins, distance = bins[known], np.hypot(*hits[known].T)
    nearest = np.full(len(ranges), np.inf)
    np.minimum.at(nearest, bins, distance)
    first = nearest[bins]
    same = distance <= first + SAME_SURFACE * np.sqrt(config.range_variance(first))
    count = np.bincount(bins[same], minlength=len(ranges))
    total = np.bincount(bins[same], distance[same], minlength=len(ranges))
    seen = count > 0
    ranges[seen] = total[seen] / count[seen]
    return ranges


def _crossings(begin: Array, end: Array, radius: float) -> Array:
    """Return where segments in the plane leave a circle about the origin, shape (m, 2)."""
    leaves = (np.hypot(*begin.T) <= radius) & (np.hypot(*end.T) > radius)
    begin, way = begin[leaves], (end - begin)[leaves]
    a, b = np.sum(way * way, axis=1), np.sum(begin * way, axis=1)
    c = np.sum(begin * begin, axis=1) - radius**2
    share = (np.sqrt(b * b - a * c) - b) / a
    return np.asarray(begin + share[:, None] * way)


def _bins(points: Array, config: LevelScanConfig, turn: float) -> tuple[NDArray[np.intp], Mask]:
    """Return the number of each point's azimuth, turned, and whether it is of the level scan."""
    azimuth = np.arctan2(points[:, 1], points[:, 0]) + turn
    bins = np.rint((azimuth + config.level_scan_angle) / config.increment).astype(np.intp)
    if config.is_full_circle:
        bins %= config.level_scan_beams
    return bins, (bins >= 0) & (bins < config.level_scan_beams)
