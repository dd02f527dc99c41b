"""Figures of a recorded sensor: latency, drops, distance of the points to the true surfaces."""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from nodlidar_assembler.assembly import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ego_motion import Odometry, Poses
from nodlidar_assembler.geometry import ScanGeometry
from nodlidar_assembler.pipeline import Pipeline, Scan
from nodlidar_assembler.sensor_log import assemble_log, SensorLog
from nodlidar_common.errors import NodlidarError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import time_ns
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world import World
import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores

FAR = 3.0
"""Beams up to this range [m] count for the distance to the surfaces: a pitch error costs as much
more as a beam is longer, so that a figure means nothing without it."""

MAX_JOINT_GAP = AssemblerConfig().max_joint_gap


class EvaluationError(NodlidarError):
    """A log that has nothing to evaluate."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """What a bag says about the clouds that were published.

    Attributes
    ----------
    latency
        From a scan's last byte at the port to the publication of its cloud [s], shape (n,).
    dropped
        Drops that the nodes reported in their last diagnostics, counted by reason.
    clouds, points
        How many were received.
    """

    latency: NDArray[np.float64]
    dropped: Counter[str]
    clouds: int
    points: int


def read_delivery(bag: Path) -> Delivery:
    """Return what a bag with clouds per scan says about their delivery."""
    arrivals: dict[int, int] = {}
    clouds: list[tuple[int, int]] = []
    dropped: dict[str, Counter[str]] = {}
    points = 0
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, published_ns, raw in reader.messages():
            name = connection.topic.rsplit('/', 1)[-1]
            if name not in ('arrival', 'points', 'diagnostics'):
                continue
            message: Any = reader.deserialize(raw, connection.msgtype)
            if name == 'arrival':
                arrivals[time_ns(message.time_ref)] = time_ns(message.header.stamp)
            elif name == 'points':
                clouds.append((time_ns(message.header.stamp), published_ns))
                points += message.width
            else:
                dropped |= {status.name: _drops_of(status) for status in message.status}
    return Delivery(
        _latency(arrivals, clouds), sum(dropped.values(), Counter()), len(clouds), points
    )


def _drops_of(status: Any) -> Counter[str]:
    """Return the positive counts under the keys 'dropped: reason' of a diagnostic status."""
    found = {v.key: v.value for v in status.values if v.key.startswith('dropped: ')}
    return +Counter({key.removeprefix('dropped: '): int(n) for key, n in found.items()})


def _latency(arrivals: dict[int, int], clouds: list[tuple[int, int]]) -> NDArray[np.float64]:
    """Pair each cloud with the last scan whose first beam is not after its first point."""
    scans = np.array(sorted(arrivals), dtype=np.int64)
    stamps, published = np.array(clouds, dtype=np.int64).reshape(-1, 2).T
    scan = np.searchsorted(scans, stamps, side='right') - 1
    last_byte = np.array([arrivals[int(s)] for s in scans[scan[scan >= 0]]], dtype=np.int64)
    return np.asarray((published[scan >= 0] - last_byte) / NS_PER_S, dtype=np.float64)


def points_of(log: SensorLog, estimator: str, mount: Pose) -> Points:
    """Return all points of a log; raises EvaluationError if there are none."""
    clouds, drops = assemble_log(log, Pipeline(estimator, 'scan', mount, MAX_JOINT_GAP))
    if not clouds:
        raise EvaluationError(f'the log gives no points; scans dropped: {dict(drops)}')
    origin = clouds[0].origin
    times = np.concatenate([cloud.time_ns for cloud in clouds])
    data = np.concatenate([cloud.counted_from(origin).data for cloud in clouds])
    return Points(times, data, origin)


def near_beams(log: SensorLog) -> SensorLog:
    """Return a log without the beams that are longer than FAR."""
    scans = [replace(scan, geometry=replace(scan.geometry, range_max=FAR)) for scan in log.scans]
    return replace(log, scans=scans)


def simulated_log(simulated: Recording) -> SensorLog:
    """Return what the simulator's devices told, without the truth."""
    sensor = simulated.sensor
    geometry = ScanGeometry(
        beams=len(simulated.azimuth),
        angle_min=float(simulated.azimuth[0]),
        angle_increment=sensor.angle_increment,
        time_increment=sensor.time_increment,
        range_min=sensor.range_min,
        range_max=sensor.range_max,
    )
    ranges = simulated.ranges.astype(np.float32)
    scans = [
        Scan(int(stamp_ns), geometry, scan_ranges)
        for stamp_ns, scan_ranges in zip(simulated.scan_stamp_ns, ranges, strict=True)
    ]
    return SensorLog(scans, simulated.joint_stamp_ns, simulated.joint_position)


def surface_rms(points: Points, world: World) -> float:
    """Return the RMS distance of points in nodlidar_base_link to the true surfaces [m]."""
    distance = world.surface_distance(xyz_of(points), points.time_ns)
    return float(np.sqrt(np.mean(distance**2)))


def simulated_odometry(simulated: Recording) -> Odometry:
    """Return the odometry of nodlidar_base_link that the simulator's wheels told."""
    x, y, yaw = simulated.odometry_pose.T
    zero = np.zeros_like(x)
    orientation = np.stack([zero, zero, np.sin(yaw / 2.0), np.cos(yaw / 2.0)], axis=1)
    of_base = Odometry(
        simulated.odometry_stamp_ns, Poses(np.stack([x, y, zero], axis=1), orientation)
    )
    return of_base.mounted(simulated.world.scene.mount)


def moved_surface_rms(xyz: NDArray[np.float64], simulated: Recording) -> float:
    """Return the RMS distance of points (n, 3) in the frame of odometry to the true surfaces [m].

    That frame is base_link where it was at the first sample.
    """
    x, y, yaw = simulated.world.base.poses(simulated.odometry_stamp_ns[:1])[0]
    in_world = Pose.from_xyzrpy((x, y, 0.0, 0.0, 0.0, yaw)).to_parent(xyz)
    distance = simulated.world.scene.surfaces.surface_distance(in_world)
    return float(np.sqrt(np.mean(distance**2)))


def xyz_of(points: Points) -> NDArray[np.float64]:
    """Return the coordinates of points [m], shape (n, 3)."""
    return np.stack([points.data[axis] for axis in 'xyz'], axis=1).astype(np.float64)
