"""Mixed pixels: how many points of a cloud are, and which the filter of the assembler removes.

A point is a mixed pixel if it is farther from every surface than three standard deviations of the
lidar's noise at its range, and if its spot straddles an edge: without noise, too, its range is
off by a standard deviation or more. Points are placed with the true pitch: only the lidar errs.
"""

from dataclasses import dataclass, replace

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.mixed_pixels import find_mixed_pixels, MixedPixelConfig
from nodlidar_common.arrays import Array, Mask
from nodlidar_common.nod import Nod
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.scene import Scene
import numpy as np
from numpy.typing import NDArray

from bench.errors.edge_scenes import drawn_room, shipped_scenes
from bench.shared.reference import reference_nod, START_NS
from bench.shared.report import Row
from bench.shared.rms import rms
from bench.shared.timing import interleaved

LIDARS = ('urg_04lx_ug01', 'urg_04lx')
DRAWN = 20
SIGMAS = 3.0
STILL_AT = (-0.35, -0.05, 0.2)  # rad
NODDING, STILL = 'pi rad/s', 'still'
ROUNDS = 2000
REMOVED, LOST, SHARE = 'mixed pixels removed [%]', 'others removed [%]', 'mixed pixels [%]'
RMS, RMS_KEPT = 'RMS to the surfaces [mm]', 'with the filter [mm]'
TIME = 'time of the filter per scan [us]'
CONFIG = MixedPixelConfig()
TITLE = (
    f'Mixed pixels, mixed_pixel_angle = {CONFIG.mixed_pixel_angle} rad; drawn: {DRAWN} furnished '
    f'rooms; still: at {", ".join(map(str, STILL_AT))} rad'
)


@dataclass(frozen=True, slots=True)
class Count:
    """Mixed pixels and others, and how many of each the filter removes."""

    mixed: int
    mixed_removed: int
    others: int
    others_removed: int

    def __add__(self, other: 'Count') -> 'Count':
        return Count(
            self.mixed + other.mixed,
            self.mixed_removed + other.mixed_removed,
            self.others + other.others,
            self.others_removed + other.others_removed,
        )

    def row(self) -> Row:
        """Return the shares."""
        return {
            SHARE: 100.0 * self.mixed / (self.mixed + self.others),
            REMOVED: 100.0 * self.mixed_removed / self.mixed if self.mixed else None,
            LOST: 100.0 * self.others_removed / self.others,
        }


NOTHING = Count(0, 0, 0, 0)


def results(drawn: int = DRAWN) -> list[Row]:
    """Return the shares by scene, lidar and nod, and the filter's time per scan."""
    rows: list[Row] = []
    for name in LIDARS:
        for kind in (NODDING, STILL):
            lidar = load_lidar(name)
            shipped = {one.name: counted(one, lidar, kind) for one in shipped_scenes()}
            rooms = [counted(drawn_room(seed), lidar, kind) for seed in range(drawn)]
            every = sum([*shipped.values(), *rooms], NOTHING)
            groups = {**shipped, 'drawn': sum(rooms, NOTHING), 'all': every}
            rows += [
                {'scene': scene, 'lidar': name, 'nod': kind, **count.row()}
                for scene, count in groups.items()
            ]
    return [*rows, *rms_rows(), {TIME: time_per_scan() * 1e6}]


def rms_rows() -> list[Row]:
    """Return the RMS distances of the points to the surfaces, with and without the filter."""
    rows: list[Row] = []
    for name in LIDARS:
        for scene in shipped_scenes():
            seen = simulate(
                replace(scene, lidar=load_lidar(name)), reference_nod(), 6.0, start_ns=START_NS
            )
            measured = np.isfinite(seen.ranges)
            distance = _distance(seen, measured)
            kept = distance[~removed_points(seen)[measured]]
            found = {RMS: rms(distance) * 1e3, RMS_KEPT: rms(kept) * 1e3}
            rows.append({'scene': scene.name, 'lidar': name, **found})
    return rows


def counted(scene: Scene, lidar: LidarParameters, kind: str) -> Count:
    """Return the counts of a scene, seen by a lidar with a nod."""
    nods = [reference_nod()] if kind == NODDING else [still(pitch) for pitch in STILL_AT]
    duration = 6.0 if kind == NODDING else 1.0
    return sum((_counted(scene, lidar, nod, duration) for nod in nods), NOTHING)


def still(pitch: float) -> Nod:
    """Return a nod that is at a pitch [rad] within a microradian."""
    return Nod(pitch - 1e-6, pitch + 1e-6, 1.0, 10_240, START_NS)


def _counted(scene: Scene, lidar: LidarParameters, nod: Nod, duration: float) -> Count:
    seen, spot_only = (
        simulate(replace(scene, lidar=each), nod, duration, seed=1, start_ns=START_NS)
        for each in (lidar, LidarParameters(divergence=lidar.divergence))
    )
    measured, removed = np.isfinite(seen.ranges), removed_points(seen)
    mixed = mixed_pixels(seen, spot_only, lidar)
    others = measured & ~mixed
    pairs = (mixed, mixed & removed, others, others & removed)
    return Count(*(int(np.count_nonzero(each)) for each in pairs))


def mixed_pixels(seen: Recording, spot_only: Recording, lidar: LidarParameters) -> Mask:
    """Return which beams are mixed pixels, by the definition above; shape (scans, beams)."""
    measured = np.isfinite(seen.ranges)
    ranges = np.where(measured, seen.ranges, 0.0)
    sigma = lidar.sigma(ranges)
    with np.errstate(invalid='ignore'):
        at_edge = np.abs(spot_only.ranges - seen.true_range) >= sigma
    at_edge |= np.isinf(seen.true_range) & np.isfinite(spot_only.ranges)
    chosen = measured & at_edge
    far = np.zeros(measured.shape, dtype=np.bool_)
    far[chosen] = _distance(seen, chosen) > SIGMAS * sigma[chosen]
    return far


def removed_points(seen: Recording) -> Mask:
    """Return which beams the filter removes, shape (scans, beams)."""
    scans = simulated_log(seen).scans
    return np.array([find_mixed_pixels(scan.ranges, scan.geometry, CONFIG) for scan in scans])


def time_per_scan() -> float:
    """Return the time of the filter for a scan of the room [s]."""
    room = next(scene for scene in shipped_scenes() if scene.name == 'room')
    lidar = load_lidar(LIDARS[0])
    seen = simulate(replace(room, lidar=lidar), reference_nod(), 0.2, start_ns=START_NS)
    scan = simulated_log(seen).scans[-1]
    given: tuple[NDArray[np.float32], ScanGeometry] = scan.ranges, scan.geometry
    [(seconds, _)] = interleaved({'filter': lambda: find_mixed_pixels(*given, CONFIG)}, ROUNDS)
    return float(seconds)


def _distance(seen: Recording, chosen: Mask) -> Array:
    """Return the distance of some points, placed with the true pitch, to the surfaces [m]."""
    azimuth = np.broadcast_to(seen.azimuth, chosen.shape)[chosen]
    ranges, pitch = seen.ranges[chosen], seen.true_pitch[chosen]
    ahead, left = ranges * np.cos(azimuth), ranges * np.sin(azimuth)
    up, level, arm = np.sin(pitch), np.cos(pitch), seen.world.scene.optical_offset
    points = np.stack([ahead * level - arm * up, left, ahead * up + arm * level], axis=1)
    return seen.world.surface_distance(points, seen.true_time_ns[chosen])
