"""Odometry from the wheels of a base, with its errors."""

from __future__ import annotations

from typing import Protocol

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.planar import displacement, motion_of, relative, rotate
import numpy as np

WHEEL_DISTANCE = 0.4  # between the two driven wheels [m]
_SIDES = np.array([-0.5, 0.5]) * WHEEL_DISTANCE


class Base(Protocol):
    """The pose of a base at any instant."""

    def poses(self, times_ns: Times) -> Array:
        """Return x [m], y [m], yaw [rad] at each time [ns], (n, 3); (1, 3) if it never moves."""


class Odometer:
    """Estimates the pose of a base from its two wheels; the origin is the pose at the start.

    Each wheel miscounts its distance by a constant share (wheels of unknown size: position and
    heading drift), and overcounts by a share that is random in each sample (slip). The heading
    also drifts at a constant rate, at rest as well. Without effects, the poses are exact.

    Parameters
    ----------
    base
        The true motion; between samples it turns by less than half a revolution.
    effects
        Their odometry_error, wheel_slip and heading_drift.
    start_ns
        Start of the estimate [ns].
    seed
        Of the errors.

    Attributes
    ----------
    start_ns
        The parameter.
    """

    def __init__(self, base: Base, effects: Effects, start_ns: int, seed: int = 0) -> None:
        self.start_ns = start_ns
        self._base = base
        self._exact = not effects.affect_odometry
        self._origin: Array = base.poses(np.array([start_ns], dtype=np.int64))
        self._last = self._origin
        self._last_ns = start_ns
        self._estimate: Array = np.zeros((1, 3))
        if self._exact:
            return
        self._slip = effects.wheel_slip
        self._rng = np.random.default_rng(seed)
        self._counted = 1.0 + effects.odometry_error * self._rng.normal(size=2)
        self._drift = effects.heading_drift * float(self._rng.normal())

    def poses(self, times_ns: Times) -> Array:
        """Return x [m], y [m], yaw [rad] of base_link in odom, shape (n, 3).

        Each call samples at times [ns] later than those of the calls before.
        """
        poses = np.broadcast_to(self._base.poses(times_ns), (len(times_ns), 3))
        if self._exact:
            return relative(self._origin, poses)
        steps = motion_of(relative(np.concatenate([self._last, poses[:-1]]), poses))
        elapsed = np.diff(times_ns, prepend=self._last_ns) / NS_PER_S
        estimates = _add_up(self._estimate, displacement(self._counted_motion(steps, elapsed)))
        self._last, self._last_ns = poses[-1:], int(times_ns[-1])
        self._estimate = estimates[-1:]
        return estimates

    def _counted_motion(self, steps: Array, elapsed: Array) -> Array:
        """Return motions (n, 3) as the wheels count them, in samples of given durations [s]."""
        wheels = (steps[:, :1] + steps[:, 2:] * _SIDES) * self._counted
        if self._slip > 0.0:
            wheels = wheels * (1.0 + np.abs(self._rng.normal(0.0, self._slip, wheels.shape)))
        turned = (wheels[:, 1] - wheels[:, 0]) / WHEEL_DISTANCE + self._drift * elapsed
        return np.stack([wheels.mean(axis=1), steps[:, 1], turned], axis=1)


def _add_up(start: Array, displacements: Array) -> Array:
    """Return the poses (n, 3) after each of successive displacements from a start."""
    yaws = start[0, 2] + np.cumsum(displacements[:, 2]) - displacements[:, 2]
    return np.asarray(start + np.cumsum(rotate(displacements, yaws), axis=0))
