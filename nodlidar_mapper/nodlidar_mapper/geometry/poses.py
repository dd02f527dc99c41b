"""Poses in space as homogeneous matrices, shape (..., 4, 4).

A covariance (6, 6) is of a change as `corrected` takes it: x, y, z [m] and turns [rad]
about these axes, those of the parent frame, through the pose's own position. An information is
the inverse of a covariance.
"""

from nodlidar_common.arrays import Array
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation


def inverse(pose: Array) -> Array:
    """Return the inverses of poses."""
    back = np.zeros_like(pose)
    turned = np.swapaxes(pose[..., :3, :3], -1, -2)
    back[..., :3, :3] = turned
    back[..., :3, 3] = -(turned @ pose[..., :3, 3, None])[..., 0]
    back[..., 3, 3] = 1.0
    return back


def moved(pose: Array, points: Array) -> Array:
    """Return points (n, 3) of the frame with a pose in its parent frame."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def shifted(points: Array, changes: Array) -> Array:
    """Return points, or one, turned about the origin and shifted, by a change (n, 6) each."""
    if not len(changes):
        return np.empty((0, 3))
    turned = Rotation.from_rotvec(changes[:, 3:]).apply(points)
    return np.asarray(turned + changes[:, :3])


def corrected(pose: Array, change: Array) -> Array:
    """Return poses after small changes (x, y, z, and turns about these axes), shape (..., 6).

    The position is shifted; the orientation turns about the position. All in the parent frame.
    """
    result = pose.copy()
    turns = np.reshape(change[..., 3:], (-1, 3))
    turned = Rotation.from_rotvec(turns).as_matrix().reshape(*change.shape[:-1], 3, 3)
    result[..., :3, :3] = turned @ pose[..., :3, :3]
    result[..., :3, 3] += change[..., :3]
    return result


def change_between(start: Array, end: Array) -> Array:
    """Return the change (..., 6) by which `corrected` makes one pose of another."""
    turns = (end[..., :3, :3] @ np.swapaxes(start[..., :3, :3], -1, -2)).reshape(-1, 3, 3)
    turns = Rotation.from_matrix(turns).as_rotvec().reshape(*end.shape[:-2], 3)
    return np.concatenate([end[..., :3, 3] - start[..., :3, 3], turns], axis=-1)


def lever(way: Array) -> Array:
    """Return the matrix (6, 6) by which a way (3,) in the parent frame carries a pose's change.

    An error of the heading becomes one of the place.
    """
    x, y, z = way
    matrix = np.eye(6)
    matrix[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return matrix


def turning(rotation: Array) -> Array:
    """Return the matrices (..., 6, 6) by which rotations (..., 3, 3) turn a pose's change."""
    matrix = np.zeros((*rotation.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = rotation
    return matrix


def carried(covariance: Array, way: Array) -> Array:
    """Return the covariance (6, 6) of a pose's change after a way (3,) in the parent frame [m]."""
    arm = lever(way)
    return np.asarray(arm @ covariance @ arm.T)


def matrix_from(rotation: Array, position: ArrayLike) -> Array:
    """Return a pose as a matrix (4, 4), from a rotation (3, 3) and a position (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def planar(x: float, y: float, yaw: float) -> Array:
    """Return the pose of a frame in the plane z = 0."""
    pose = np.eye(4)
    pose[:2, 3] = x, y
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    return pose


def yaw_of(pose: Array) -> float:
    """Return the heading of a pose [rad]."""
    return float(np.arctan2(pose[1, 0], pose[0, 0]))


def placed(pose: Array, flat: Array) -> Array:
    """Return a pose with x, y and yaw of another one; its height and tilt stay."""
    here = planar(pose[0, 3], pose[1, 3], yaw_of(pose))
    there = planar(flat[0, 3], flat[1, 3], yaw_of(flat))
    return np.asarray(there @ inverse(here) @ pose)


def between(one: Array, other: Array) -> tuple[float, float]:
    """Return the distance [m] and the turn [rad] between two poses."""
    turned = (np.trace(one[:3, :3].T @ other[:3, :3]) - 1.0) / 2.0
    distance = np.linalg.norm(one[:3, 3] - other[:3, 3])
    return float(distance), float(np.arccos(np.clip(turned, -1.0, 1.0)))
