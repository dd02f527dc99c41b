"""Clouds as of one instant: each point from where the robot was at its own instant."""

from dataclasses import replace

from nodlidar_assembler.clouds.ego_motion import Poses, rotated, rotated_back
from nodlidar_assembler.clouds.point_layout import xyz_in
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S

DESKEW_INSTANTS = {'last': -1, 'first': 0}


def deskewed(points: Points, instant: str = 'last') -> Points:
    """Return points in nodlidar_base_link as of the instant of one of them, stamped with it.

    Points without poses are returned as they are; see `as_of`.

    Parameters
    ----------
    points
        DESKEWED_POINTs in nodlidar_base_link, each as of its own instant, with its pose.
    instant
        A key of DESKEW_INSTANTS: the point whose instant it is.
    """
    if points.poses is None:
        return points
    k = DESKEW_INSTANTS[instant]
    data = points.data.copy()
    data['x'], data['y'], data['z'] = as_of(xyz_in(data), points.poses, k).T
    stamp_ns = int(points.time_ns[k])
    data['age'] = (stamp_ns - points.time_ns) / NS_PER_S
    return replace(points, data=data, poses=None, stamp_ns=stamp_ns)


def as_of(xyz: Array, poses: Poses, k: int = -1) -> Array:
    """Return points (n, 3) [m], each in the frame of its own pose, in the frame of pose k.

    A point p, seen from the pose (R, t) in the frame of odometry, is at R_0^T (R p + t - t_0) in
    the base frame of the pose (R_0, t_0).
    """
    moved = rotated(poses.orientation, xyz) + (poses.position - poses.position[k])
    return rotated_back(poses.orientation[k, None], moved)
