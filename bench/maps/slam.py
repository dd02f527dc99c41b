"""SLAM programs on the same deskewed clouds of simulated drives: how far their paths are off.

With the errors of a URG-04LX-UG01 and an RX-24F. Odometry has errors of scale and slip. Paths are
aligned at the first cloud.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
import time
from typing import Any, Protocol

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.bags.sensor_log import clouds_in, SensorLog
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import age_of, odometry_at
from nodlidar_sim.simulation import Recording
import numpy as np
import yaml

from bench.maps.drives import CONFIG, DRIVES, recorded, rms_error, scene_of, true_poses
from bench.maps.slam_programs import Kiss, OdometryAlone, SmallGicp
from bench.shared.report import Row

TITLE = 'SLAM programs, worst of the seeds; errors of the positions as a share of the path'
SEEDS = range(1, 4)


class Program(Protocol):
    """A program that estimates the pose of each cloud."""

    def add(self, cloud: Points, odometry: Array) -> Array:
        """Return the pose of a cloud, given the one by odometry."""


class OurMapper:
    """nodlidar_mapper, with poses as known at the time."""

    def __init__(self) -> None:
        self._mapper = Mapper(MapConfig())

    def add(self, cloud: Points, odometry: Array) -> Array:
        """Return the pose of a cloud."""
        given = Cloud(cloud.stamp_ns, cloud.xyz, odometry, age=age_of(cloud))
        return np.asarray(self._mapper.add(given).pose)


@dataclass(frozen=True, slots=True)
class Use:
    """A way to use a program: how to start it, and the number of sweeps in a cloud."""

    start: Callable[[], Program]
    sweeps: int = 1


def kiss_parameters() -> dict[str, Any]:
    """Return the parameters of kiss-icp's node that nodlidar_bringup ships."""
    share = Path(get_package_share_directory('nodlidar_bringup'))
    content = yaml.safe_load((share / 'config' / 'slam' / 'kiss_icp.yaml').read_text())
    return dict(content['/**']['ros__parameters'])


USES = {
    'odometry alone': Use(OdometryAlone),
    'kiss-icp, as its node': Use(lambda: Kiss(kiss_parameters(), prior=False)),
    'kiss-icp, odometry as prior': Use(lambda: Kiss(kiss_parameters(), prior=True)),
    'kiss-icp, odometry as prior, 4 sweeps': Use(lambda: Kiss(kiss_parameters(), prior=True), 4),
    'small_gicp to a submap, 4 sweeps': Use(SmallGicp, 4),
    'nodlidar_mapper': Use(OurMapper),
}


@dataclass(frozen=True, slots=True)
class Followed:
    """A drive that a program followed.

    Attributes
    ----------
    error
        RMS error of the positions as a share of the path.
    seconds
        Median computing time of a cloud [s].
    """

    error: float
    seconds: float


def drive(name: str, route: str | None, duration: float, seed: int) -> tuple[SensorLog, Recording]:
    """Return what real devices recorded on a drive, and the truth."""
    recording = recorded(scene_of(name, route, 1.0, ideal=False), duration, seed)
    return simulated_drive(recording), recording


def followed(log: SensorLog, recording: Recording, use: Use) -> Followed:
    """Return how well a program follows a drive."""
    program, poses, stamps, seconds = use.start(), [], [], []
    for cloud in clouds_in(log, replace(CONFIG, sweeps_per_cloud=use.sweeps))[0]:
        odometry = odometry_at(log, cloud.stamp_ns)
        begin = time.process_time()
        poses.append(program.add(cloud, odometry).copy())
        seconds.append(time.process_time() - begin)
        stamps.append(cloud.stamp_ns)
    truth = true_poses(recording, np.array(stamps))
    truth[:, 2, 3] = odometry_at(log, stamps[0])[2, 3]
    path = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).sum()
    return Followed(rms_error(truth, poses) / float(path), float(np.median(seconds)))


def results() -> list[Row]:
    """Return the error and the cost of each program on each drive."""
    rows: dict[str, Row] = {name: {'program': name} for name in USES}
    for scene, route, duration in DRIVES:
        drives = [drive(scene, route, duration, seed) for seed in SEEDS]
        for name, use in USES.items():
            found = [followed(*each, use) for each in drives]
            rows[name][f'{scene} [%]'] = 100.0 * max(each.error for each in found)
            seconds = max(each.seconds for each in found)
            rows[name][f'{scene}, per cloud [ms]'] = 1e3 * seconds
    return list(rows.values())
