"""Maps a recorded drive."""

from collections.abc import Iterable

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import OdometryConfig
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.stamps import NS_PER_S
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.geometry.poses import Array, matrix_from
from nodlidar_mapper.graph.keyframe import Estimate
from nodlidar_mapper.mapper import Mapper
import numpy as np
from scipy.spatial.transform import Rotation

LIMITS = OdometryConfig()


def estimates(
    mapper: Mapper, clouds: Iterable[Points], log: SensorLog, limits: OdometryConfig = LIMITS
) -> list[Estimate]:
    """Map the clouds of a drive; return where each was taken, as known at that time."""
    mount = mount_of(log)
    return [
        mapper.add(
            Cloud(
                each.stamp_ns,
                each.xyz,
                odometry_at(log, each.stamp_ns, limits),
                mount,
                age_of(each),
            )
        )
        for each in clouds
    ]


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
