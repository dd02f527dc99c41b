"""What a joint_trajectory_controller commands to a joint, by the rules in its source.

ros2_controllers 4.42 (Jazzy): `validate_trajectory_msg` and `update` in
joint_trajectory_controller.cpp, `sample` and `interpolate_between_points` in trajectory.cpp, which
it was compared with. Its parameters are those of nodlidar_bringup/config/controllers.yaml.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import NodlidarError
from nodlidar_common.stamps import NS_PER_S
import numpy as np

_NOT_GIVEN = (np.nan, np.nan)


class TrajectoryError(NodlidarError):
    """The controller refuses a trajectory."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """The points of a trajectory of one joint.

    Attributes
    ----------
    start_ns
        Its stamp [ns]; 0: now.
    times_ns
        Time of each point from the start [ns], shape (n,).
    states
        Position [rad], velocity [rad/s] and acceleration [rad/s^2] there, shape (n, 3); NaN if
        not given.
    """

    start_ns: int
    times_ns: Times
    states: Array

    def check(self, now_ns: int) -> None:
        """Raise TrajectoryError if a controller does not take it at a time [ns]."""
        if not len(self.times_ns):
            raise TrajectoryError('it is empty')
        if abs(self.states[-1, 1]) > np.finfo(np.float32).eps:
            raise TrajectoryError('the velocity of its last point is not zero')
        if self.start_ns and self.start_ns + self.times_ns[-1] < now_ns:
            raise TrajectoryError('it ends in the past')
        if (np.diff(self.times_ns) <= 0).any():
            raise TrajectoryError('its times are not strictly increasing')


class TrajectoryController:
    """Holds a joint where it is, follows the latest trajectory, and holds its end.

    The trajectory is a straight line between two positions, a cubic between those with velocities
    and a quintic between those with accelerations. It begins where the joint is measured, if the
    first point is still to come. Points that are past are passed over.
    """

    def __init__(self) -> None:
        self._accepted: Trajectory | None = None
        self._followed: Trajectory | None = None
        self._knots_ns: Times | None = None
        self._spline: Callable[..., float]

    def accept(self, trajectory: Trajectory, now_ns: int) -> None:
        """Replace the trajectory from the next update on; safe between threads.

        Raises
        ------
        TrajectoryError
            If it is refused: the joint goes on as before.
        """
        trajectory.check(now_ns)
        self._accepted = trajectory

    def update(self, now_ns: int, position: float, velocity: float) -> None:
        """Begin what was accepted, from where the joint is measured at a time [ns]."""
        new, measured = self._accepted, (position, velocity, 0.0)
        if new is not None and new is not self._followed:
            self._followed = new
            times_ns = (new.start_ns or now_ns) + new.times_ns
            self._follow(times_ns, new.states, now_ns, measured)
        elif self._knots_ns is None:
            self._follow(np.array([now_ns]), np.array([[position, *_NOT_GIVEN]]), now_ns, measured)

    def at(self, time_ns: int) -> tuple[float, float]:
        """Return position [rad] and velocity [rad/s] at a time [ns], no earlier than an update."""
        assert self._knots_ns is not None
        elapsed = (min(time_ns, int(self._knots_ns[-1])) - self._knots_ns[0]) / NS_PER_S
        return float(self._spline(elapsed)), float(self._spline(elapsed, 1))

    def _follow(
        self, times_ns: Times, states: Array, now_ns: int, measured: tuple[float, float, float]
    ) -> None:
        # Imported here, since it takes as long as all other modules of an emulator.
        from scipy.interpolate import BPoly

        if now_ns < times_ns[0]:
            times_ns, states = np.r_[now_ns, times_ns], np.vstack([measured, states])
        # The end is held: a line to the same position.
        times_ns = np.r_[times_ns, max(times_ns[-1], now_ns) + NS_PER_S]
        states = np.vstack([states, [states[-1, 0], *_NOT_GIVEN]])
        given = np.cumprod(np.isfinite(states), axis=1).sum(axis=1)
        values = [state[:count] for state, count in zip(states, given, strict=True)]
        orders = 2 * np.minimum(given[:-1], given[1:]) - 1
        self._knots_ns = times_ns
        elapsed = (times_ns - times_ns[0]) / NS_PER_S
        self._spline = BPoly.from_derivatives(elapsed, values, orders.tolist())
