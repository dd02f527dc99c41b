"""Fig. 11: a drive toward an object ahead, with fixed and with compensated pitch limits.

Three arms: the node's default limits without compensation; fixed limits that see just the band of
heights from the start; and the node's own control (AdaptiveLimits), which moves limits and N_s by
scans and odometry.

The drive takes 4001 frames. Repeats are beams in a cell of the finest grid (lidar steps x rows of
span/N_s, of the default limits) that an earlier beam has hit. Repeats in space are points ahead
and in the band of heights that share a cube with an earlier point.

The nod is that of the servo loop, commanded as in the node: tied to the lidar's revolutions, with
new limits in mid-sweep. Devices with errors are the lidar and the servo of the scene, by physics;
beside them, an ideal lidar on a servo with the faults of phase_lock. Points are assembled from the
joint samples by slerp. Odometry is exact, at 50 Hz, and comes through the history of the TF input.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.pipeline import Assembled, Pipeline, PipelineConfig, Scan
from nodlidar_assembler.control.adaptive_limits import AdaptiveLimits, AdaptiveLimitsConfig
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock
from nodlidar_assembler.control.pitch_limits import (
    limits_at,
    PitchLimitsConfig,
    ranges_that_count,
    SECTOR,
)
from nodlidar_common.arrays import Array, Integers, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.scene import load_scene, Scene
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.world import World
import numpy as np

from bench.nod.servo_rig import LOADED, Rig, Tied, TRUE_BEAM_NS, URG
from bench.shared.reference import SPAN, STANDING, START_NS
from bench.shared.report import Row
from bench.shared.rms import means

TITLE = 'Fig. 11: drive toward an object ahead, share of repeats and evenness over the height'

CONFIG = PitchLimitsConfig()
DEFAULT, FIXED, COMPENSATED = ARMS = ('default', 'fixed to the band', 'compensated')
POINTS = 'points in the band [1000]'
# Scene, start and end of the drive [m].
DRIVES = (('wall', -2.0, 1.0), ('room', -1.0, 1.0))
N_S = 4001
SCAN_TIME = 1024 * TRUE_BEAM_NS / NS_PER_S
SETTLING = 20  # scans from rest to the nod, before the robot drives
HISTORY = 100  # joint samples kept: more than a second
SLACK_NS = 1_000_000  # the lidar's beams come a little sooner than its scan states [ns]
ODOMETRY_NS = 20_000_000  # from one sample to the next [ns]
SENSOR = SensorModel()
CUBES = (0.0025, 0.005, 0.01)  # m
SEEDS = 1, 2, 3  # of the errors of the devices
BINS = np.linspace(CONFIG.band_bottom, CONFIG.band_top, 20)


@dataclass(frozen=True, slots=True)
class Drive:
    """The points and the nod of a drive.

    Attributes
    ----------
    points
        In the world, ahead and in the band of heights, shape (n, 3).
    pitch
        Of every beam [rad], shape (scans, beams).
    samples_per_sweep
        N_s at each scan, shape (scans,).
    """

    points: Array
    pitch: Array
    samples_per_sweep: Integers


def results() -> list[Row]:
    """Return points, repeats and evenness over the height of each arm, and ratios."""
    rows = []
    for (name, start, end), ideal in product(DRIVES, (False, True)):
        scene = load_scene(name, ideal=ideal)
        seeds = SEEDS[:1] if ideal else SEEDS
        arms = {
            arm: means([_figures(drive(scene, start, end, arm, seed)) for seed in seeds])
            for arm in ARMS
        }
        for other in (DEFAULT, FIXED):
            arms[f'{COMPENSATED} / {other}'] = {
                key: value / arms[other][key] for key, value in arms[COMPENSATED].items()
            }
        what = {'scene': name, 'devices': 'ideal lidar' if ideal else 'with errors'}
        rows += [{**what, 'limits': arm, **figures} for arm, figures in arms.items()]
    return rows


def drive(
    scene: Scene, start: float, end: float, arm: str, seed: int = SEEDS[0], frames: int = N_S
) -> Drive:
    """Drive from a place to another [m] in so many frames; the loop is closed scan by scan.

    The seed is that of the errors of the devices.
    """
    speed = (end - start) / (frames * SCAN_TIME)
    there = replace(scene.with_velocity((speed, 0.0)), base_start=(start, 0.0, 0.0))
    config = AdaptiveLimitsConfig()
    limits = config.pitch_min, config.pitch_max
    if arm == FIXED:
        limits = limits_at(CONFIG, _first_range(scene, start, seed))
    sensor, adaptive = NoddingSensor(there, limits, seed), AdaptiveLimits(config)
    points, pitch, samples = [], [], []
    for assembled, odometry, seen in sensor.scans(frames):
        if arm == COMPENSATED:
            adaptive.add(assembled, odometry)
            shape = adaptive.shape()
            if shape is not None:
                sensor.change(shape)
        ahead = np.abs(np.arctan2(seen[:, 1], seen[:, 0])) <= SECTOR
        in_band = (seen[:, 2] > CONFIG.band_bottom) & (seen[:, 2] < CONFIG.band_top)
        x = sensor.place(assembled.scan.stamp_ns)
        points.append(seen[ahead & in_band] + (x, 0.0, 0.0))
        pitch.append(assembled.pitch)
        samples.append(sensor.samples_per_sweep)
    return Drive(np.concatenate(points), np.array(pitch), np.array(samples))


def _first_range(scene: Scene, start: float, seed: int) -> float:
    there = replace(scene.with_velocity(STANDING), base_start=(start, 0.0, 0.0))
    _, _, seen = next(NoddingSensor(there, (-0.1, 0.1), seed).scans(1))
    return float(np.median(ranges_that_count(CONFIG, seen)))


class NoddingSensor:
    """The lidar on the servo, on a base that starts once the nod has settled.

    Parameters
    ----------
    scene
        With the start and the speed of the base, the lidar's errors and the servo, or none.
    limits
        Of the nod at the start [rad].
    seed
        Of the errors.
    """

    def __init__(self, scene: Scene, limits: tuple[float, float], seed: int) -> None:
        self._rig = Rig(scene.servo or LOADED, seed)
        self._tied = Tied(self._rig, seed)
        self._tied.nod = PhaseLock(NodShape(*limits, N_S), SENSOR.steps)
        self._begin_ns = START_NS + round(SETTLING * SCAN_TIME * NS_PER_S)
        self._world = World(scene, self._rig.motion, start_ns=self._begin_ns)
        self._lidar = Lidar(scene.lidar, self._world, START_NS, seed)
        arm = (0.0, 0.0, scene.optical_offset)
        self._pipeline = Pipeline(PipelineConfig(laser_xyz=arm))
        self._samples: deque[tuple[int, float]] = deque(maxlen=HISTORY)
        self._odometry = OdometryHistory()
        self._odometry_ns = START_NS

    @property
    def samples_per_sweep(self) -> int:
        """N_s that is commanded."""
        return self._tied.nod.shape.samples_per_sweep

    def change(self, shape: NodShape) -> None:
        """Command another nod."""
        if shape != self._tied.nod.shape:
            self._tied.nod.change(shape, self._rig.clock())
            self._tied.command()

    def place(self, time_ns: int) -> float:
        """Return x of the base at an instant [m]."""
        return float(self._world.base.poses(np.array([time_ns]))[0, 0])

    def scans(self, count: int) -> Iterator[tuple[Assembled, Odometry, Array]]:
        """Yield each scan of the drive when it has been assembled.

        Yield the scan, the odometry from its first beam on, and the points: x, y from the place of
        the base at that beam and the height [m], shape (n, 3).
        """
        for scan in range(SETTLING, SETTLING + count):
            beams = scan * SENSOR.steps + np.arange(SENSOR.first_step, SENSOR.last_step + 1)
            beams_ns = START_NS + np.rint(beams * TRUE_BEAM_NS).astype(np.int64)
            while not self._samples or self._samples[-1][0] < beams_ns[-1] + SLACK_NS:
                for sample in self._tied.cycle():
                    self._samples.append((sample.stamp_ns, sample.pitch))
            assembled = self._assembled(beams_ns)
            seen = self._seen(assembled, self.place(int(beams_ns[0])))
            yield assembled, self._odometry_since(int(beams_ns[0])), seen

    def _assembled(self, beams_ns: Times) -> Assembled:
        ranges = self._lidar.ranges(beams_ns, SENSOR.azimuth)
        scan = Scan(int(beams_ns[0]), URG, SENSOR.rounded_ranges(ranges).astype(np.float32))
        stamps, pitch = (np.array(each) for each in zip(*self._samples, strict=True))
        return self._pipeline.add_scan(scan, stamps, pitch)

    def _seen(self, assembled: Assembled, x: float) -> Array:
        (cloud,) = assembled.clouds
        driven = self._world.base.poses(cloud.time_ns)[:, :1] - x
        in_base = self._world.scene.mount.to_parent(cloud.xyz)
        return in_base + driven * (1.0, 0.0, 0.0)

    def _odometry_since(self, begin_ns: int) -> Odometry:
        while self._odometry_ns <= self._rig.clock():
            position = (self.place(self._odometry_ns), 0.0, 0.0)
            self._odometry.add(self._odometry_ns, position, (0.0, 0.0, 0.0, 1.0))
            self._odometry_ns += ODOMETRY_NS
        return self._odometry.around(begin_ns, self._odometry_ns)


def _figures(driven: Drive) -> Row:
    """Return points in the band, shares of repeats, the evenness over height, and N_s."""
    return {
        POINTS: len(driven.points) / 1000.0,
        'repeats, finest grid': repeats(of_finest_grid(driven.pitch)),
        **{f'{1e3 * cube:g} mm': repeats(np.floor(driven.points / cube)) for cube in CUBES},
        'CV over height': variation(driven.points),
        'least N_s': float(driven.samples_per_sweep.min()),
        'largest N_s': float(driven.samples_per_sweep.max()),
    }


def of_finest_grid(pitch: Array) -> Array:
    """Return the cell of each beam on the default nod's finest grid, shape (n, 2)."""
    beams = np.broadcast_to(np.arange(pitch.shape[1]), pitch.shape)
    return np.stack([beams.ravel(), np.floor(pitch.ravel() / (SPAN / N_S))], axis=1)


def variation(points: Array) -> float:
    """Return the coefficient of variation of the points (n, 3) over the height."""
    counts, _ = np.histogram(points[:, 2], bins=BINS)
    return float(counts.std() / counts.mean())


def repeats(cells: Array) -> float:
    """Return the share of cells, shape (n, d), that equal an earlier one."""
    return 1.0 - len(np.unique(cells.astype(np.int64), axis=0)) / len(cells)
