"""Poses and motions in the plane: x [m], y [m], yaw [rad], as rows (n, 3).

A single row (1, 3) broadcasts to any number. Yaws are summed and never wrapped.
"""

from __future__ import annotations

from nodlidar_common.arrays import Array
from nodlidar_common.pose import Pose
import numpy as np


def rotate(vectors: Array, yaw: Array) -> Array:
    """Return vectors (n, 3) rotated about z by angles [rad] of shape (n,) or (1,)."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors.T
    return np.asarray(np.stack([cosine * x - sine * y, sine * x + cosine * y, z + 0.0 * yaw]).T)


def to_parent(points: Array, poses: Array) -> Array:
    """Return points (n, 3) [m], one in the frame of each pose, in the parent frame."""
    return rotate(points, poses[:, 2]) + _offset(poses)


def to_child(points: Array, poses: Array) -> Array:
    """Return points (n, 3) [m] of the parent frame, one in the frame of each pose."""
    return rotate(points - _offset(poses), -poses[:, 2])


def to_space(pose: Array) -> Pose:
    """Return a pose (3,) in the plane as a pose in space."""
    x, y, yaw = pose
    return Pose.from_xyzrpy((x, y, 0.0, 0.0, 0.0, yaw))


def compose(poses: Array, children: Array) -> Array:
    """Return child poses (n, 3), given in the frames of `poses`, in the parent frame of those."""
    return rotate(children, poses[:, 2]) + poses


def relative(poses: Array, others: Array) -> Array:
    """Return other poses (n, 3) in the frames of poses: compose(poses, the result) is them."""
    return rotate(others - poses, -poses[:, 2])


def advance(poses: Array, motions: Array) -> Array:
    """Return poses after motions with constant twists: the exponential map of SE(2).

    A motion is the distance ahead [m], the distance to the left [m] and the turn q [rad], shape
    (n, 3). The path is an arc; its chord is shorter by sinc(q/2) and has the mean heading.
    """
    ahead, left, q = motions.T
    shorter = np.sinc(q / (2.0 * np.pi))
    chord = np.stack([ahead * shorter, left * shorter, q]).T
    return poses + rotate(chord, poses[:, 2] + q / 2.0)


def displacement(motions: Array) -> Array:
    """Return the poses after motions from the origin, as in `advance`; shape (n, 3)."""
    return advance(np.zeros((1, 3)), motions)


def motion_of(displacements: Array) -> Array:
    """Return the motion with constant twist to a pose: the logarithm of SE(2); shape (n, 3).

    The turn is the shortest one, from -pi to pi, for any yaw.
    """
    q = np.remainder(displacements[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    straight = rotate(displacements, -q / 2.0)
    ahead, left, _ = straight.T / np.sinc(q / (2.0 * np.pi))
    return np.stack([ahead, left, q], axis=1)


def _offset(poses: Array) -> Array:
    return np.asarray(poses * [1.0, 1.0, 0.0])
