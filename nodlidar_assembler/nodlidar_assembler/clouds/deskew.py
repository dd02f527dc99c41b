"""Clouds as of one instant: each point from where the robot was at its own instant."""

from dataclasses import replace

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import rotated
import numpy as np

DESKEW_INSTANTS = {'last': -1, 'first': 0}


def deskewed(points: Points, instant: str = 'last') -> Points:
    """Return points in nodlidar_base_link as of the instant of one of them, stamped with it.

    A point p, seen from the pose (R, t) in the frame of odometry, is at R_0^T (R p + t - t_0) in
    the base frame of the pose (R_0, t_0). Points without poses are returned as they are.

    Parameters
    ----------
    points
        Points in nodlidar_base_link, each as of its own instant, with its pose.
    instant
        A key of DESKEW_INSTANTS: the point whose instant it is.
    """
    if points.poses is None:
        return points
    k = DESKEW_INSTANTS[instant]
    then = points.poses.position[k], points.poses.orientation[k]
    data = points.data.copy()
    xyz = np.stack([data[axis] for axis in 'xyz'], axis=1, dtype=np.float64)
    moved = points.poses.to_parent(xyz, then[0])
    back = np.broadcast_to(then[1] * (-1.0, -1.0, -1.0, 1.0), points.poses.orientation.shape)
    data['x'], data['y'], data['z'] = rotated(back, moved).T
    return replace(points, data=data, poses=None, stamp_ns=int(points.time_ns[k]))
