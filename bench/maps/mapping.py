"""Maps of drives through scenes: how far path and map are off, and what they cost.

With the errors of a URG-04LX-UG01 and an RX-24F, and with ideal devices but 10 mm of range noise.
Odometry has errors of scale and slip. Paths are aligned at the first cloud, where the map begins,
and by the best fit.
"""

from dataclasses import dataclass
import time

from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_common.arrays import Array
from nodlidar_demo.evaluation import moved_surface_rms
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import inverse, moved
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import age_of, odometry_at
from nodlidar_mapper.output.lasting import lasting_surface
from nodlidar_sim.simulation import Recording
import numpy as np
from scipy.spatial.transform import Rotation

from bench.maps.drives import (
    CONFIG,
    DRIVES,
    recorded,
    rms_error,
    scene_of,
    speed_up,
    top_speed,
    true_poses,
)
from bench.shared.reference import START_NS
from bench.shared.report import Row

TITLE = 'Mapped drives, worst of the seeds; errors of the positions as a share of the path'
SEEDS = range(1, 6)


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """A mapped drive.

    Attributes
    ----------
    path
        Its length [m].
    live, final, odometry
        RMS errors of the positions as known at the time, at the end, and by odometry [m].
    fitted
        RMS error at the end after the best fit of the whole path, as evo and others state it [m].
    surface
        RMS distance of the map's points from the true surfaces [m].
    seconds
        Computing time of each cloud [s], shape (n,).
    lost, loops
        Clouds that did not fit the map, and loops closed.
    """

    path: float
    live: float
    final: float
    odometry: float
    fitted: float
    surface: float
    seconds: Array
    lost: int
    loops: int


def mapped(recording: Recording) -> Mapped:
    """Map a recording, and compare it with the truth."""
    log = simulated_drive(recording)
    mapper, found, seconds, by_odometry = Mapper(MapConfig()), [], [], []
    for cloud in clouds_in(log, CONFIG)[0]:
        points, odometry = cloud.xyz, odometry_at(log, cloud.stamp_ns)
        begin = time.process_time()
        found.append(mapper.add(Cloud(cloud.stamp_ns, points, odometry, age=age_of(cloud))))
        seconds.append(time.process_time() - begin)
        by_odometry.append(odometry)
    truth = true_poses(recording, np.array([each.stamp_ns for each in found]))
    mount = by_odometry[0][2, 3]
    truth[:, 2, 3] = mount
    final = list(mapper.poses_of(found))
    surface = lasting_surface(mapper.map.keyframes)
    in_odom = moved(truth[0] @ inverse(final[0]), surface.points)
    stamps = np.full(len(in_odom), START_NS, dtype=np.int64)
    way = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1)
    return Mapped(
        float(way.sum()),
        rms_error(truth, [each.pose for each in found]),
        rms_error(truth, final),
        rms_error(truth, by_odometry),
        best_fit(truth, final),
        moved_surface_rms(in_odom, stamps, recording.world),
        np.array(seconds),
        sum(bool(each.lost) for each in found[1:]),
        mapper.map.loops,
    )


def best_fit(truth: Array, poses: list[Array]) -> float:
    """Return the RMS error of positions after the best rotation and shift [m]."""
    places, true = np.stack(poses)[:, :3, 3], truth[:, :3, 3]
    _, root = Rotation.align_vectors(true - true.mean(axis=0), places - places.mean(axis=0))
    return float(root / np.sqrt(len(places)))


def results() -> list[Row]:
    """Return the errors and the cost of each drive, with real and with ideal devices."""
    return [
        _row(name, route, duration, fast, ideal)
        for name, route, duration in DRIVES
        for fast in (False, True)
        for ideal in (False, True)
    ]


def errors_of(runs: list[Mapped]) -> Row:
    """Return the worst errors of several drives, the mean loops, and all clouds not matched."""
    return {
        'path [m]': max(run.path for run in runs),
        'odometry [%]': 100.0 * max(run.odometry / run.path for run in runs),
        'live [%]': 100.0 * max(run.live / run.path for run in runs),
        'final [%]': 100.0 * max(run.final / run.path for run in runs),
        'final, best fit [%]': 100.0 * max(run.fitted / run.path for run in runs),
        'map [mm]': 1e3 * max(run.surface for run in runs),
        'loops': sum(run.loops for run in runs) / len(runs),
        'clouds not matched': sum(run.lost for run in runs),
    }


def _row(name: str, route: str | None, duration: float, fast: bool, ideal: bool) -> Row:
    faster = speed_up(name, route) if fast else 1.0
    scene = scene_of(name, route, faster, ideal)
    runs = [mapped(recorded(scene, duration / faster, seed)) for seed in SEEDS]
    seconds = np.concatenate([run.seconds for run in runs])
    return {
        'scene': name,
        'devices': 'ideal, 10 mm of noise' if ideal else 'with errors',
        'speed [m/s]': top_speed(scene),
        **errors_of(runs),
        'computation per cloud [ms]': 1e3 * float(np.median(seconds)),
        '99 % [ms]': 1e3 * float(np.percentile(seconds, 99)),
    }
