"""The plane that a base moves in: poses and motions x [m], y [m], yaw [rad], as rows (n, 3).

A single row (1, 3) goes with any number of others. Yaws are added up and never wrapped.
"""

from __future__ import annotations

from nodlidar_common.pose import Pose
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def turn(vectors: Array, yaw: Array) -> Array:
    """Return vectors (n, 3) turned about z by angles [rad] of shape (n,) or (1,)."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors.T
    return np.asarray(np.stack([cosine * x - sine * y, sine * x + cosine * y, z + 0.0 * yaw]).T)


def to_parent(points: Array, poses: Array) -> Array:
    """Return points (n, 3) in the parent frame of poses."""
    return turn(points, poses[:, 2]) + _offset(poses)


def to_child(points: Array, poses: Array) -> Array:
    """Return points (n, 3) of the parent frame in the frames of poses."""
    return turn(points - _offset(poses), -poses[:, 2])


def to_space(pose: Array) -> Pose:
    """Return one pose (3,) of the plane as a pose in space."""
    x, y, yaw = pose
    return Pose.from_xyzrpy((x, y, 0.0, 0.0, 0.0, yaw))


def compose(poses: Array, children: Array) -> Array:
    """Return poses that are given in the frames of other poses in the parent frame of those."""
    return turn(children, poses[:, 2]) + poses


def relative(poses: Array, others: Array) -> Array:
    """Return other poses in the frames of poses: compose(poses, relative(poses, b)) is b."""
    return turn(others - poses, -poses[:, 2])


def advance(poses: Array, motions: Array) -> Array:
    """Return the poses that constant twists lead to from poses: the exponential map of SE(2).

    Motions are the way ahead [m], the way to the left [m] and the turn q [rad], shape (n, 3). The
    way bends into an arc whose chord is shorter by sinc(q/2) and lies along the mean heading.
    """
    ahead, left, q = motions.T
    shorter = np.sinc(q / (2.0 * np.pi))
    chord = np.stack([ahead * shorter, left * shorter, q]).T
    return poses + turn(chord, poses[:, 2] + q / 2.0)


def displacement(motions: Array) -> Array:
    """Return the poses that motions lead to from 0, as `advance` does; shape (n, 3)."""
    return advance(np.zeros((1, 3)), motions)


def motion_of(displacements: Array) -> Array:
    """Return the motion of a constant twist that leads to a pose: the logarithm of SE(2).

    The turn is the shortest one, from -pi to pi, whatever the yaw; shape (n, 3) as `displacement`.
    """
    q = np.remainder(displacements[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    straight = turn(displacements, -q / 2.0)
    ahead, left, _ = straight.T / np.sinc(q / (2.0 * np.pi))
    return np.stack([ahead, left, q], axis=1)


def _offset(poses: Array) -> Array:
    return np.asarray(poses * [1.0, 1.0, 0.0])
