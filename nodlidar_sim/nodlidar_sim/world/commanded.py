"""A base driven by velocity commands."""

from __future__ import annotations

from collections.abc import Sequence
import math

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.route import Leg, Plan, Route, Velocity
import numpy as np

MEMORY_NS = NS_PER_S  # for which past poses are kept: longer than a revolution of the lidar


class CommandedBase:
    """Drives at the velocity of the last command, and stops after its timeout.

    Commands and requests for poses may come from different threads.

    Parameters
    ----------
    start
        Initial x [m], y [m], yaw [rad].
    start_ns
        Initial time [ns].
    timeout
        For which a command is valid [s].
    """

    def __init__(self, start: Sequence[float], start_ns: int, timeout: float) -> None:
        self._timeout = timeout
        self._route = Plan().route(start, start_ns)

    def drive(self, velocity: Velocity, now_ns: int) -> None:
        """Drive at a forward speed [m/s] and a turn rate [rad/s] from a time [ns] on.

        Raises
        ------
        ParameterError
            If the velocity is not finite.
        """
        if not all(map(math.isfinite, velocity)):
            raise ParameterError('velocity', 'finite', list(velocity))
        [pose] = self.poses(np.array([now_ns], dtype=np.int64))
        plan = Plan(legs=(Leg(self._timeout, velocity),))
        self._route = _joined(self._route, plan.route(pose, now_ns))

    def poses(self, times_ns: Times) -> Array:
        """Return x, y, yaw at each time [ns], shape (n, 3) or (1, 3), without further commands.

        Times earlier than MEMORY_NS before the last command are not supported.
        """
        return self._route.poses(times_ns)


def _joined(route: Route, rest: Route) -> Route:
    """Return a route continued by another one, without pieces older than MEMORY_NS."""
    ends_ns = np.append(route.starts_ns[1:], rest.starts_ns[0])
    kept = (route.starts_ns < rest.starts_ns[0]) & (ends_ns > rest.starts_ns[0] - MEMORY_NS)
    return Route(
        np.concatenate([route.starts_ns[kept], rest.starts_ns]),
        np.concatenate([route.starts[kept], rest.starts]),
        np.concatenate([route.twists[kept], rest.twists]),
    )
