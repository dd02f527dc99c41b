"""Fig. 11: a drive toward what is ahead, with fixed pitch limits and with compensated ones.

Points that count lie ahead and in the band of heights; a repeat lies in a cube of space that a
point before it lies in. Fixed limits are those that see the whole band from the start.
"""

from dataclasses import replace

from nodlidar_assembler.pitch_limits import (
    limits_at,
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_common.nod import NodTrajectory, NS_PER_S
from nodlidar_sim.scene import load_scene, Scene
from nodlidar_sim.simulation import Recording, simulate
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

Floats = NDArray[np.float64]

CONFIG = PitchLimitsConfig()
# Scene, start and end of the drive [m].
DRIVES = (('wall', -2.0, 1.0), ('room', -1.0, 1.0))
SPEED = 0.05  # m/s
N_S, SCAN_TIME = 4001, 0.1
CUBES = (0.005, 0.01, 0.02)  # m
BINS = np.linspace(CONFIG.z_bottom, CONFIG.z_top, 20)


def table() -> Table:
    """Return repeats and evenness over the height, with and without compensation."""
    result = Table(title=f'Fig. 11: drive at {SPEED} m/s, repeats in cubes and evenness')
    for name in ('scene', 'limits', 'points', *(f'{1e3 * c:.0f} mm' for c in CUBES), 'CV'):
        result.add_column(name, justify='right')
    for name, start, end in DRIVES:
        fixed, steered = (
            _figures(drive(load_scene(name), start, end, compensate))
            for compensate in (False, True)
        )
        result.add_row(name, 'fixed', *_words(fixed))
        result.add_row('', 'compensated', *_words(steered))
        result.add_row('', 'ratio', '', *(f'{x:.3f}' for x in (steered / fixed)[1:]))
        result.add_section()
    return result


def drive(scene: Scene, start: float, end: float, compensate: bool) -> Floats:
    """Return the points in the world that count, shape (n, 3); the loop is closed scan by scan."""
    limits, points = PitchLimits(CONFIG), []
    first = limits_at(CONFIG, _first_range(scene, start))
    for scan in range(round((end - start) / SPEED / SCAN_TIME)):
        x, now_ns = start + SPEED * SCAN_TIME * scan, round(scan * SCAN_TIME * NS_PER_S)
        followed = limits.limits(now_ns)
        seen = _scan(scene, x, SPEED, followed if compensate and limits.range else first, now_ns)
        limits.update(now_ns, ranges_that_count(CONFIG, seen))
        limits.moved(SPEED * SCAN_TIME)
        ahead = np.abs(np.arctan2(seen[:, 1], seen[:, 0])) <= CONFIG.sector
        in_band = (seen[:, 2] > CONFIG.z_bottom) & (seen[:, 2] < CONFIG.z_top)
        points.append(seen[ahead & in_band] + (x, 0.0, 0.0))
    return np.concatenate(points)


def _first_range(scene: Scene, start: float) -> float:
    return float(np.median(ranges_that_count(CONFIG, _scan(scene, start, 0.0, (-0.1, 0.1), 0))))


def _scan(
    scene: Scene, x: float, speed: float, limits: tuple[float, float], now_ns: int
) -> Floats:
    """Return what a scan sees: x, y from the base as it begins, and the height, shape (n, 3)."""
    nod = NodTrajectory(*limits, N_S * SCAN_TIME / 1024, N_S, 0)
    there = replace(scene, base_start=(x, 0.0, 0.0), base_velocity=(speed, 0.0))
    recording = simulate(there, nod, SCAN_TIME, start_ns=now_ns)
    return _points(recording, scene, speed, now_ns)


def _points(recording: Recording, scene: Scene, speed: float, now_ns: int) -> Floats:
    ranges = recording.ranges[0]
    kept = np.isfinite(ranges)
    r, pitch, azimuth = ranges[kept], recording.true_pitch[0, kept], recording.azimuth[kept]
    ahead, arm = r * np.cos(azimuth), scene.optical_offset
    driven = speed * (recording.true_time_ns[0, kept] - now_ns) / NS_PER_S
    in_mount = np.stack(
        [
            ahead * np.cos(pitch) - arm * np.sin(pitch),
            r * np.sin(azimuth),
            ahead * np.sin(pitch) + arm * np.cos(pitch),
        ],
        axis=1,
    )
    return scene.mount.to_parent(in_mount) + np.outer(driven, (1.0, 0.0, 0.0))


def _figures(points: Floats) -> Floats:
    """Return the points, the repeats in each size of cube, and the CV of points over height."""
    repeats = [
        len(points) - len(np.unique(np.floor(points / cube).astype(int), axis=0)) for cube in CUBES
    ]
    counts, _ = np.histogram(points[:, 2], bins=BINS)
    return np.array([len(points), *repeats, counts.std() / counts.mean()])


def _words(figures: Floats) -> list[str]:
    return [*(f'{x:.0f}' for x in figures[:-1]), f'{figures[-1]:.3f}']
