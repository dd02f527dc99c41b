"""Maps a recorded drive."""

from collections.abc import Iterable

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import OdometryConfig
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_common.silence import LEAST_SILENCE
from nodlidar_common.stamps import NS_PER_S
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.geometry.poses import matrix_from
from nodlidar_mapper.graph.keyframe import Estimate
from nodlidar_mapper.mapper import Mapper
import numpy as np
from scipy.spatial.transform import Rotation

LIMITS = OdometryConfig()


def estimates(
    mapper: Mapper, clouds: Iterable[Points], log: SensorLog, limits: OdometryConfig = LIMITS
) -> list[Estimate]:
    """Map the clouds of a drive; return where each was taken, as known at that time."""
    mount, last_ns, found = mount_of(log), None, []
    for each in clouds:
        odometry, stamp_ns = odometry_at(log, each.stamp_ns, limits), each.stamp_ns
        silence = silence_between(log, stamp_ns if last_ns is None else last_ns, stamp_ns)
        found.append(mapper.add(Cloud(stamp_ns, each.xyz, odometry, mount, age_of(each), silence)))
        last_ns = stamp_ns
    return found


def silence_between(log: SensorLog, begin_ns: int, end_ns: int) -> float:
    """Return for how long odometry was silent between two instants [ns], in s."""
    assert log.odometry is not None
    times_ns = log.odometry.time_ns
    within = times_ns[(begin_ns < times_ns) & (times_ns < end_ns)]
    gaps = np.diff(within, prepend=begin_ns, append=end_ns) / NS_PER_S
    return float(gaps[gaps > LEAST_SILENCE].sum())


def age_of(cloud: Points) -> Array:
    """Return the time from each point to the stamp of its cloud [s], shape (n,)."""
    return (cloud.stamp_ns - cloud.time_ns) / NS_PER_S


def mount_of(log: SensorLog) -> Array:
    """Return the pose of the clouds' frame in that of the robot, as a matrix."""
    assert log.odometry is not None
    mount = log.odometry.mount
    return matrix_from(mount.rotation, mount.position)


def odometry_at(log: SensorLog, stamp_ns: int, limits: OdometryConfig = LIMITS) -> Array:
    """Return the pose of the clouds' frame in that of odometry at an instant, as a matrix."""
    assert log.odometry is not None
    found = log.odometry.at(np.array([stamp_ns]), limits)
    return matrix_from(Rotation.from_quat(found.orientation[0]).as_matrix(), found.position[0])
