"""The uncertainty of wheel odometry, from the known errors of its wheels."""

from __future__ import annotations

import math

from nodlidar_common.arrays import Array
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.odometry import WHEEL_DISTANCE
import numpy as np

# Distance ahead and turn of a base, from the distances of its left and its right wheel.
_BY_WHEELS = np.array([[0.5, 0.5], [-1.0 / WHEEL_DISTANCE, 1.0 / WHEEL_DISTANCE]])
_WHEELS = np.linalg.inv(_BY_WHEELS)
# Square of the mean of |N(0, 1)|.
_MEAN_SQUARED = 2.0 / math.pi


class OdometryUncertainty:
    """Propagates the errors of an Odometer to its pose, to first order.

    The result is the mean square E[e eᵀ] of the error e. This equals the covariance except for the
    slip, whose mean is not 0, since wheels only overcount: the mean is included.

    Parameters
    ----------
    effects
        Their odometry_error, wheel_slip and heading_drift.
    """

    def __init__(self, effects: Effects) -> None:
        slip = effects.wheel_slip**2
        self._steady = np.diag([effects.odometry_error**2] * 2 + [effects.heading_drift**2])
        self._steady[:2, :2] += slip * _MEAN_SQUARED
        self._random = slip * (1.0 - _MEAN_SQUARED)
        self._to_steady = np.zeros((3, 3))
        self._scatter = np.zeros((3, 3))

    def add(self, yaw: float, motion: Array, elapsed: float) -> None:
        """Add a sample: heading before [rad]; motion ahead, left and turn (3,); duration [s]."""
        ahead, _, turn = motion
        heading = yaw + turn / 2.0
        x, y = math.cos(heading), math.sin(heading)
        by_motion = np.array([[x, -y * ahead / 2.0], [y, x * ahead / 2.0], [0.0, 1.0]])
        by_share = by_motion @ _BY_WHEELS * _wheels(motion)
        carried = np.array([[1.0, 0.0, -y * ahead], [0.0, 1.0, x * ahead], [0.0, 0.0, 1.0]])
        by_steady = np.column_stack([by_share, by_motion[:, 1] * elapsed])
        self._to_steady = carried @ self._to_steady + by_steady
        self._scatter = carried @ self._scatter @ carried.T + self._random * by_share @ by_share.T

    @property
    def of_pose(self) -> Array:
        """Mean square error of x [m], y [m], yaw [rad] in odom, shape (3, 3)."""
        return np.asarray(self._to_steady @ self._steady @ self._to_steady.T + self._scatter)

    def of_velocity(self, velocity: Array) -> Array:
        """Return that of the speeds ahead and left [m/s] and the turn rate [rad/s], (3, 3)."""
        wheels = _wheels(velocity)
        shares = self._steady[:2, :2] + self._random * np.eye(2)
        of_motion = _BY_WHEELS @ (shares * np.outer(wheels, wheels)) @ _BY_WHEELS.T
        of_motion[1, 1] += self._steady[2, 2]
        result = np.zeros((3, 3))
        result[np.ix_([0, 2], [0, 2])] = of_motion
        return result


def _wheels(motion: Array) -> Array:
    """Return the motion of the left and the right wheel (2,) in a motion of the base (3,)."""
    return np.asarray(_WHEELS @ motion[[0, 2]])
