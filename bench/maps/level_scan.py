"""Level scans of drives through scenes, against level rays cast through the band of heights.

With the errors of a URG-04LX-UG01 and an RX-24F, and with ideal devices but 10 mm of range noise.
Odometry has errors of scale and slip.
"""

from dataclasses import dataclass

from nodlidar_assembler.bags.sensor_log import outcomes, SensorLog
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.clouds.level_scan import LevelScan, LevelScanner
from nodlidar_common.arrays import Array
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_sim.world.planar import rotate, to_parent
from nodlidar_sim.world.world import World
import numpy as np
from numpy.typing import NDArray

from bench.maps.drives import CONFIG, DRIVES, recorded, scene_of, speed_up, top_speed
from bench.shared.report import Row

DURATION = 60.0
HEIGHTS = 40  # of the level rays
ENOUGH = 0.98  # of the azimuths
SEEDS = range(1, 6)
TITLE = f'Level scans of drives of {DURATION:.0f} s, once per sweep, worst of the seeds'


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Level scans beside the truth, shape (n, level_scan_beams) each.

    Attributes
    ----------
    ranges
        Of the level scans [m].
    truth
        Nearest surface in the band [m], inf if there is none up to level_scan_range.
    """

    ranges: NDArray[np.float32]
    truth: Array

    @property
    def known(self) -> Array:
        """Share of the azimuths that each level scan knows, shape (n,)."""
        return np.asarray(np.mean(~np.isnan(self.ranges), axis=1))

    @property
    def errors(self) -> Array:
        """Errors of the ranges where there is a surface [m], shape (m,)."""
        both = np.isfinite(self.ranges) & np.isfinite(self.truth)
        return np.asarray(self.ranges[both] - self.truth[both])

    def free_in_front_of(self, distance: float) -> float:
        """Return the share of azimuths that are +inf with a surface up to a distance [m]."""
        return float(np.mean(np.isposinf(self.ranges) & (self.truth < distance)))


def level_scans(log: SensorLog, config: LevelScanConfig) -> list[LevelScan]:
    """Return the level scans of a log."""
    scanner = LevelScanner(config)
    assembled = (outcome.assembled for outcome in outcomes(log, CONFIG))
    return [found for each in assembled if each is not None for found in scanner.add(each)]


def true_ranges(world: World, stamp_ns: int, config: LevelScanConfig) -> Array:
    """Return the nearest of the level rays in the band per azimuth [m], (level_scan_beams,)."""
    beams = config.level_scan_beams
    floor = config.sensor_height - config.laser_xyz[2]
    heights = np.linspace(config.band_bottom, config.band_top, HEIGHTS + 2)[1:-1] - floor
    azimuth = np.repeat(config.increment * np.arange(beams) - config.level_scan_angle, HEIGHTS)
    zero = np.zeros_like(azimuth)
    pose, mount = world.base.poses(np.array([stamp_ns])), world.scene.mount
    origins = np.stack([zero, zero, np.tile(heights, beams)], axis=1)
    ways = np.stack([np.cos(azimuth), np.sin(azimuth), zero], axis=1)
    rays = to_parent(mount.to_parent(origins), pose), mount.directions_to_parent(ways)
    times = np.full(len(azimuth), stamp_ns)
    ranges = world.distances(rays[0], rotate(rays[1], pose[:, 2]), times)
    nearest = ranges.reshape(beams, HEIGHTS).min(axis=1)
    return np.where(nearest > config.level_scan_range, np.inf, nearest)


def judged(log: SensorLog, world: World, config: LevelScanConfig) -> Judged:
    """Return the level scans of a log, and the truth."""
    scans = level_scans(log, config)
    truth = [true_ranges(world, scan.stamp_ns, config) for scan in scans]
    return Judged(np.stack([scan.ranges for scan in scans]), np.stack(truth))


def results() -> list[Row]:
    """Return how much level scans know and how far they are off, in each scene."""
    return [
        _row(name, route, fast, ideal)
        for name, route, _ in DRIVES
        for fast in (False, True)
        for ideal in (False, True)
    ]


def _row(name: str, route: str | None, fast: bool, ideal: bool) -> Row:
    faster = speed_up(name, route) if fast else 1.0
    scene, config = scene_of(name, route, faster, ideal), LevelScanConfig(level_scan='sweep')
    recordings = (recorded(scene, DURATION, seed) for seed in SEEDS)
    found = [judged(simulated_drive(each), each.world, config) for each in recordings]
    off = [np.abs(each.errors) for each in found]
    free, far = config.level_scan_free, config.level_scan_range
    return {
        'scene': name,
        'devices': 'ideal, 10 mm of noise' if ideal else 'with errors',
        'speed [m/s]': top_speed(scene),
        'azimuths known [%]': 100.0 * min(float(each.known.mean()) for each in found),
        'least of a sweep [%]': 100.0 * min(float(each.known.min()) for each in found),
        f'sweeps with {ENOUGH:.0%} known [%]': 100.0
        * min(float(np.mean(each.known >= ENOUGH)) for each in found),
        'median error [mm]': 1e3 * max(float(np.median(each)) for each in off),
        '90 % of the errors [mm]': 1e3 * max(float(np.percentile(each, 90)) for each in off),
        'falsely free up to 2 m [%]': 100.0 * max(each.free_in_front_of(free) for each in found),
        'up to 5 m [%]': 100.0 * max(each.free_in_front_of(far) for each in found),
    }
