"""Fig. 11: a drive toward what is ahead, with fixed pitch limits and with compensated ones.

Points that count lie ahead and in the band of heights; a repeat lies in a cube of space that a
point before it lies in. Fixed limits are those that see the whole band from the start.

The nod is that of the servo loop with all its faults (phase_lock), commanded as live: tied to the
lidar's revolutions, other limits in mid-sweep. Points are what the assembler makes of the joint
samples by slerp. Odometry is exact.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

from nodlidar_assembler.nod_clock import NodClock, NodShape
from nodlidar_assembler.pipeline import Pipeline, Scan
from nodlidar_assembler.pitch_limits import (
    limits_at,
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_bringup.evaluation import MAX_JOINT_GAP, xyz_of
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.pose import Pose
from nodlidar_sim.scene import load_scene, Scene
from nodlidar_sim.sensor_model import SensorModel
from nodlidar_sim.world import World
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from bench.phase_lock import LOADED, Rig, Tied, TRUE_BEAM_NS, URG
from bench.reference import START_NS

Floats = NDArray[np.float64]

CONFIG = PitchLimitsConfig()
# Scene, start and end of the drive [m].
DRIVES = (('wall', -2.0, 1.0), ('room', -1.0, 1.0))
SPEED = 0.05  # m/s
N_S = 4001
SCAN_TIME = 1024 * TRUE_BEAM_NS / NS_PER_S
SETTLING = 20  # scans from rest to the nod, before the robot drives
BRACKET = 0.03  # time after a scan within which joint samples come [s]
HISTORY = 100  # joint samples kept: more than a second
SENSOR = SensorModel()
CUBES = (0.0025, 0.005, 0.01, 0.02)  # m
SEEDS = range(3)  # of the servo's faults
BINS = np.linspace(CONFIG.z_bottom, CONFIG.z_top, 20)


def table() -> Table:
    """Return repeats and evenness over the height, with and without compensation."""
    result = Table(
        title=f'Fig. 11: drive at {SPEED} m/s, repeats in cubes and evenness, '
        f'mean of {len(SEEDS)} runs'
    )
    for name in ('scene', 'limits', 'points', *(f'{1e3 * c:g} mm' for c in CUBES), 'CV'):
        result.add_column(name, justify='right')
    for name, start, end in DRIVES:
        fixed, steered = (
            np.mean(
                [_figures(drive(load_scene(name), start, end, compensate, s)) for s in SEEDS], 0
            )
            for compensate in (False, True)
        )
        result.add_row(name, 'fixed', *_words(fixed))
        result.add_row('', 'compensated', *_words(steered))
        result.add_row('', 'ratio', '', *(f'{x:.3f}' for x in (steered / fixed)[1:]))
        result.add_section()
    return result


def drive(
    scene: Scene, start: float, end: float, compensate: bool, seed: int = SEEDS[0]
) -> Floats:
    """Return the points in the world that count, shape (n, 3); the loop is closed scan by scan."""
    scans = round((end - start) / SPEED / SCAN_TIME)
    there = replace(scene, base_start=(start, 0.0, 0.0), base_velocity=(SPEED, 0.0))
    sensor = NoddingSensor(there, limits_at(CONFIG, _first_range(scene, start)), seed)
    limits, points = PitchLimits(CONFIG), []
    for now_ns, x, seen in sensor.scans(scans):
        limits.update(now_ns, ranges_that_count(CONFIG, seen))
        limits.moved(SPEED * SCAN_TIME)
        followed = limits.limits(now_ns)
        if compensate and limits.range:
            sensor.change(followed)
        ahead = np.abs(np.arctan2(seen[:, 1], seen[:, 0])) <= CONFIG.sector
        in_band = (seen[:, 2] > CONFIG.z_bottom) & (seen[:, 2] < CONFIG.z_top)
        points.append(seen[ahead & in_band] + (x, 0.0, 0.0))
    return np.concatenate(points)


def _first_range(scene: Scene, start: float) -> float:
    there = replace(scene, base_start=(start, 0.0, 0.0), base_velocity=(0.0, 0.0))
    _, _, seen = next(NoddingSensor(there, (-0.1, 0.1), SEEDS[0]).scans(1))
    return float(np.median(ranges_that_count(CONFIG, seen)))


class NoddingSensor:
    """The lidar on the servo, on a base that drives off once the nod has settled.

    Parameters
    ----------
    scene
        With where the base starts and how fast it drives.
    limits
        Of the nod, to begin with [rad].
    seed
        Of the servo's faults.
    """

    def __init__(self, scene: Scene, limits: tuple[float, float], seed: int) -> None:
        self._rig = Rig(LOADED, seed)
        self._tied = Tied(self._rig, seed)
        self._tied.nod = NodClock(NodShape(*limits, N_S), SENSOR.steps)
        self._begin_ns = START_NS + round(SETTLING * SCAN_TIME * NS_PER_S)
        self._world = World(scene, self._rig.motion, start_ns=self._begin_ns)
        arm = Pose.from_xyzrpy((0.0, 0.0, scene.optical_offset, 0.0, 0.0, 0.0))
        self._pipeline = Pipeline('slerp', 'scan', arm, MAX_JOINT_GAP)
        self._samples: deque[tuple[int, float]] = deque(maxlen=HISTORY)

    def change(self, limits: tuple[float, float]) -> None:
        """Command other limits [rad]."""
        shape = NodShape(*limits, N_S)
        if shape != self._tied.nod.shape:
            self._tied.nod.change(shape, self._rig.clock())
            self._tied.command()

    def scans(self, count: int) -> Iterator[tuple[int, float, Floats]]:
        """Yield, scan by scan while the base drives, what is known when it has been assembled.

        That is the time [ns], x of the base as the scan begins, and the points: x, y from there
        and the height, shape (n, 3).
        """
        for scan in range(SETTLING, SETTLING + count):
            beams = scan * SENSOR.steps + np.arange(SENSOR.first_step, SENSOR.last_step + 1)
            beams_ns = START_NS + np.rint(beams * TRUE_BEAM_NS).astype(np.int64)
            while self._rig.clock() < beams_ns[-1] + BRACKET * NS_PER_S:
                sample = self._tied.cycle()
                if sample is not None:
                    self._samples.append((sample.stamp_ns, sample.pitch))
            x = float(self._world.base.poses(beams_ns[:1])[0, 0])
            yield self._rig.clock(), x, self._assembled(beams_ns, x)

    def _assembled(self, beams_ns: NDArray[np.int64], x: float) -> Floats:
        ranges = self._world.ranges(beams_ns, SENSOR.azimuth)
        scan = Scan(int(beams_ns[0]), URG, SENSOR.rounded_ranges(ranges).astype(np.float32))
        stamps, pitch = (np.array(told) for told in zip(*self._samples, strict=True))
        (cloud,) = self._pipeline.add_scan(scan, stamps, pitch)
        driven = self._world.base.poses(cloud.time_ns)[:, :1] - x
        in_base = self._world.scene.mount.to_parent(xyz_of(cloud))
        return in_base + driven * (1.0, 0.0, 0.0)


def _figures(points: Floats) -> Floats:
    """Return the points, the repeats in each size of cube, and the CV of points over height."""
    repeats = [
        len(points) - len(np.unique(np.floor(points / cube).astype(int), axis=0)) for cube in CUBES
    ]
    counts, _ = np.histogram(points[:, 2], bins=BINS)
    return np.array([len(points), *repeats, counts.std() / counts.mean()])


def _words(figures: Floats) -> list[str]:
    return [*(f'{x:.0f}' for x in figures[:-1]), f'{figures[-1]:.3f}']
