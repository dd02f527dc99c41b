"""Fig. 11: a drive toward an object ahead, with fixed and with compensated pitch limits.

The drive takes N_s frames. Repeats are beams in a cell of the finest grid (lidar steps x rows of
span/N_s, of the fixed limits) that an earlier beam has hit. Repeats in space are points ahead and
in the band of heights that share a cube with an earlier point. The fixed limits see the whole band
from the start.

The nod is that of the servo loop with all its faults (phase_lock), commanded as in the node: tied
to the lidar's revolutions, with new limits in mid-sweep. Points are assembled from the joint
samples by slerp. Odometry is exact.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.control.nod_clock import NodClock, NodShape
from nodlidar_assembler.control.pitch_limits import (
    limits_at,
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_common.nod import NS_PER_S
from nodlidar_demo.evaluation import xyz_of
from nodlidar_sim.world.scene import load_scene, Scene
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.world import World
import numpy as np
from numpy.typing import NDArray

from bench.phase_lock import LOADED, Rig, Tied, TRUE_BEAM_NS, URG
from bench.reference import START_NS
from bench.report import Row

Floats = NDArray[np.float64]

TITLE = 'Fig. 11: drive toward an object ahead, share of repeats and evenness over the height'

CONFIG = PitchLimitsConfig()
# Scene, start and end of the drive [m].
DRIVES = (('wall', -2.0, 1.0), ('room', -1.0, 1.0))
N_S = 4001
SCAN_TIME = 1024 * TRUE_BEAM_NS / NS_PER_S
SETTLING = 20  # scans from rest to the nod, before the robot drives
BRACKET = 0.03  # time after a scan within which joint samples come [s]
HISTORY = 100  # joint samples kept: more than a second
SENSOR = SensorModel()
CUBES = (0.0025, 0.005, 0.01)  # m
SEED = 1  # of the servo's faults
BINS = np.linspace(CONFIG.z_bottom, CONFIG.z_top, 20)


@dataclass(frozen=True, slots=True)
class Drive:
    """The points and the nod of a drive.

    Attributes
    ----------
    points
        In the world, ahead and in the band of heights, shape (n, 3).
    pitch
        Of every beam [rad], shape (scans, beams).
    """

    points: Floats
    pitch: Floats


def results() -> list[Row]:
    """Return repeats and evenness over the height, with and without compensation."""
    rows = []
    for name, start, end in DRIVES:
        scene = load_scene(name, ideal=True)
        fixed, steered = (drive(scene, start, end, compensate) for compensate in (False, True))
        span = float(np.ptp(fixed.pitch))
        figures = [_figures(each, span / N_S) for each in (fixed, steered)]
        ratio = {key: figures[1][key] / figures[0][key] for key in figures[0]}
        for limits, row in zip(('fixed', 'compensated', 'ratio'), (*figures, ratio), strict=True):
            rows.append({'scene': name, 'limits': limits, **row})
    return rows


def drive(scene: Scene, start: float, end: float, compensate: bool, frames: int = N_S) -> Drive:
    """Drive from a place to another [m] in so many frames; the loop is closed scan by scan."""
    speed = (end - start) / (frames * SCAN_TIME)
    there = replace(scene, base_start=(start, 0.0, 0.0), base_velocity=(speed, 0.0))
    sensor = NoddingSensor(there, limits_at(CONFIG, _first_range(scene, start)), SEED)
    limits, points, pitch = PitchLimits(CONFIG), [], []
    for now_ns, x, seen in sensor.scans(frames):
        limits.update(now_ns, ranges_that_count(CONFIG, seen))
        limits.add_motion(speed * SCAN_TIME)
        followed = limits.limits(now_ns)
        if compensate and limits.range:
            sensor.change(followed)
        ahead = np.abs(np.arctan2(seen[:, 1], seen[:, 0])) <= CONFIG.sector
        in_band = (seen[:, 2] > CONFIG.z_bottom) & (seen[:, 2] < CONFIG.z_top)
        points.append(seen[ahead & in_band] + (x, 0.0, 0.0))
        pitch.append(sensor.pitch)
    return Drive(np.concatenate(points), np.array(pitch))


def _first_range(scene: Scene, start: float) -> float:
    there = replace(scene, base_start=(start, 0.0, 0.0), base_velocity=(0.0, 0.0))
    _, _, seen = next(NoddingSensor(there, (-0.1, 0.1), SEED).scans(1))
    return float(np.median(ranges_that_count(CONFIG, seen)))


class NoddingSensor:
    """The lidar on the servo, on a base that starts once the nod has settled.

    Parameters
    ----------
    scene
        With the start and the speed of the base.
    limits
        Of the nod at the start [rad].
    seed
        Of the servo's faults.

    Attributes
    ----------
    pitch
        Of the last scan's beams, by the assembler [rad], shape (n,).
    """

    def __init__(self, scene: Scene, limits: tuple[float, float], seed: int) -> None:
        self._rig = Rig(LOADED, seed)
        self._tied = Tied(self._rig, seed)
        self._tied.nod = NodClock(NodShape(*limits, N_S), SENSOR.steps)
        self._begin_ns = START_NS + round(SETTLING * SCAN_TIME * NS_PER_S)
        self._world = World(scene, self._rig.motion, start_ns=self._begin_ns)
        arm = (0.0, 0.0, scene.optical_offset)
        self._pipeline = Pipeline(PipelineConfig(laser_xyz=arm))
        self._samples: deque[tuple[int, float]] = deque(maxlen=HISTORY)
        self.pitch: Floats = np.zeros(0)

    def change(self, limits: tuple[float, float]) -> None:
        """Command other limits [rad]."""
        shape = NodShape(*limits, N_S)
        if shape != self._tied.nod.shape:
            self._tied.nod.change(shape, self._rig.clock())
            self._tied.command()

    def scans(self, count: int) -> Iterator[tuple[int, float, Floats]]:
        """Yield each scan of the drive when it has been assembled.

        Yield the time [ns], x of the base at the begin of the scan [m], and the points: x, y from
        there and the height [m], shape (n, 3).
        """
        for scan in range(SETTLING, SETTLING + count):
            beams = scan * SENSOR.steps + np.arange(SENSOR.first_step, SENSOR.last_step + 1)
            beams_ns = START_NS + np.rint(beams * TRUE_BEAM_NS).astype(np.int64)
            while self._rig.clock() < beams_ns[-1] + BRACKET * NS_PER_S:
                for sample in self._tied.cycle():
                    self._samples.append((sample.stamp_ns, sample.pitch))
            x = float(self._world.base.poses(beams_ns[:1])[0, 0])
            yield self._rig.clock(), x, self._assembled(beams_ns, x)

    def _assembled(self, beams_ns: NDArray[np.int64], x: float) -> Floats:
        ranges = self._world.ranges(beams_ns, SENSOR.azimuth)
        scan = Scan(int(beams_ns[0]), URG, SENSOR.rounded_ranges(ranges).astype(np.float32))
        stamps, pitch = (np.array(each) for each in zip(*self._samples, strict=True))
        assembled = self._pipeline.add_scan(scan, stamps, pitch)
        self.pitch, (cloud,) = assembled.pitch, assembled.clouds
        driven = self._world.base.poses(cloud.time_ns)[:, :1] - x
        in_base = self._world.scene.mount.to_parent(xyz_of(cloud))
        return in_base + driven * (1.0, 0.0, 0.0)


def _figures(driven: Drive, row: float) -> Row:
    """Return shares of repeats, and the evenness over height; `row` is the grid's [rad]."""
    beams = np.broadcast_to(np.arange(driven.pitch.shape[1]), driven.pitch.shape)
    grid = np.stack([beams.ravel(), np.floor(driven.pitch.ravel() / row)], axis=1)
    return {
        'repeats, finest grid': repeats(grid),
        **{f'{1e3 * cube:g} mm': repeats(np.floor(driven.points / cube)) for cube in CUBES},
        'CV over height': variation(driven.points),
    }


def variation(points: Floats) -> float:
    """Return the coefficient of variation of the points (n, 3) over the height."""
    counts, _ = np.histogram(points[:, 2], bins=BINS)
    return float(counts.std() / counts.mean())


def repeats(cells: Floats) -> float:
    """Return the share of cells, shape (n, d), that equal an earlier one."""
    return 1.0 - len(np.unique(cells.astype(np.int64), axis=0)) / len(cells)
