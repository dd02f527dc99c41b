"""The base that carries the sensor: a planar motion with a constant twist, and its odometry."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WHEEL_DISTANCE = 0.4  # between the two driven wheels [m]


@dataclass(frozen=True, slots=True)
class ConstantTwist:
    """A base that stands, drives straight or drives along an arc.

    Attributes
    ----------
    start
        x [m], y [m], yaw [rad] of base_link at start_ns.
    velocity
        Forward speed [m/s] and turn rate [rad/s].
    start_ns
        When it is at the start [ns].
    """

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float] = (0.0, 0.0)
    start_ns: int = 0

    def poses(self, times_ns: NDArray[np.int64]) -> Array:
        """Return x, y, yaw at each time [ns], shape (n, 3), or (1, 3) from a base that stands.

        The chord of an arc that turned by q is v t sinc(q/2), along the mean heading.
        """
        if self.velocity == (0.0, 0.0):
            return np.array([self.start])
        elapsed = (np.asarray(times_ns, dtype=np.int64) - self.start_ns) / NS_PER_S
        speed, rate = self.velocity
        x, y, yaw = self.start
        half_turn = rate * elapsed / 2.0
        chord = speed * elapsed * np.sinc(half_turn / np.pi)
        heading = yaw + half_turn
        return np.stack(
            [x + chord * np.cos(heading), y + chord * np.sin(heading), heading + half_turn], axis=1
        )


def to_parent(points: Array, poses: Array) -> Array:
    """Return points (n, 3) in the parent frame of planar poses x, y, yaw.

    Poses have the shape (n, 3), or (1, 3) for the same one for all points.
    """
    x, y, yaw = poses.T
    return np.asarray(turn(points, yaw) + np.stack([x, y, np.zeros_like(x)]).T)


def turn(vectors: Array, yaw: Array) -> Array:
    """Return vectors (n, 3) turned about z by angles [rad] of shape (n,) or (1,)."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors.T
    return np.asarray(np.stack([cosine * x - sine * y, sine * x + cosine * y, z]).T)


def odometry_of(base: ConstantTwist, error: float, seed: int = 0) -> ConstantTwist:
    """Return the motion that wheel odometry believes in: from 0, with wheels of unknown size.

    Each of two wheels, WHEEL_DISTANCE apart, counts its way wrong by a share that is constant and
    normally distributed with the standard deviation `error`, so the estimate drifts in range and
    in heading.
    """
    speed, rate = base.velocity
    if error > 0.0:
        sides = np.array([-0.5, 0.5]) * WHEEL_DISTANCE
        wheels = (speed + rate * sides) * (1.0 + np.random.default_rng(seed).normal(0.0, error, 2))
        speed, rate = float(wheels.mean()), float(wheels[1] - wheels[0]) / WHEEL_DISTANCE
    return ConstantTwist((0.0, 0.0, 0.0), (speed, rate), base.start_ns)
