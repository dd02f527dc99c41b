"""Fixed poses in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
import numpy as np
from numpy.typing import ArrayLike
from transforms3d.euler import euler2mat
from transforms3d.quaternions import mat2quat, quat2mat


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A frame in its parent frame.

    Attributes
    ----------
    position
        Origin in the parent frame [m], shape (3,).
    rotation
        Matrix from the frame to the parent frame, shape (3, 3).
    """

    position: Array
    rotation: Array

    @classmethod
    def from_xyzrpy(cls, numbers: Sequence[float]) -> Pose:
        """Return the pose x, y, z [m], roll, pitch, yaw [rad about fixed axes, as in URDF]."""
        position = np.array(numbers[:3], dtype=np.float64)
        return cls(position, np.asarray(euler2mat(*numbers[3:], axes='sxyz'), dtype=np.float64))

    @classmethod
    def from_quaternion(cls, position: ArrayLike, orientation: ArrayLike) -> Pose:
        """Return the pose x, y, z [m] with a quaternion x, y, z, w, as in ROS."""
        wxyz = np.roll(np.asarray(orientation, dtype=np.float64), 1)
        return cls(np.array(position, dtype=np.float64), np.asarray(quat2mat(wxyz)))

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """The orientation as a unit quaternion x, y, z, w, as in ROS."""
        w, x, y, z = mat2quat(self.rotation).tolist()
        return x, y, z, w

    def to_parent(self, points: Array) -> Array:
        """Return points (n, 3) of this frame in the parent frame."""
        return self.directions_to_parent(points) + self.position

    def to_child(self, points: Array) -> Array:
        """Return points (n, 3) of the parent frame in this frame."""
        return np.asarray((points - self.position) @ self.rotation)

    def directions_to_parent(self, directions: Array) -> Array:
        """Return directions (n, 3) of this frame in the parent frame."""
        return np.asarray(directions @ self.rotation.T)

    def __matmul__(self, child: Pose) -> Pose:
        """Return a child's pose in this frame as a pose in the parent frame."""
        position = self.rotation @ child.position + self.position
        return Pose(position, self.rotation @ child.rotation)
