"""A base that is told where to drive while it drives."""

from __future__ import annotations

from collections.abc import Sequence
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_sim.world.route import Leg, Plan, Route, Velocity
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Times = NDArray[np.int64]

MEMORY_NS = NS_PER_S  # how long ago its pose is still known: longer than a turn of the lidar


class CommandedBase:
    """Drives with the velocity of the last command, and stops when none follows it in time.

    Commands may come from another thread than the one that asks for poses.

    Parameters
    ----------
    start
        x [m], y [m], yaw [rad] where it stands at first.
    start_ns
        When that is [ns].
    timeout
        How long a command holds [s].
    """

    def __init__(self, start: Sequence[float], start_ns: int, timeout: float) -> None:
        self._timeout = timeout
        self._route = Plan().route(start, start_ns)

    def drive(self, velocity: Velocity, now_ns: int) -> None:
        """Drive at a forward speed [m/s] and a turn rate [rad/s] from now [ns] on.

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
        """Return x, y, yaw at each time [ns], (n, 3) or (1, 3); as if no command came after it.

        Poses are known from MEMORY_NS before the last command on.
        """
        return self._route.poses(times_ns)


def _joined(route: Route, rest: Route) -> Route:
    """Return a route that goes over into another one, without what has long been driven."""
    ends_ns = np.append(route.starts_ns[1:], rest.starts_ns[0])
    kept = (route.starts_ns < rest.starts_ns[0]) & (ends_ns > rest.starts_ns[0] - MEMORY_NS)
    return Route(
        np.concatenate([route.starts_ns[kept], rest.starts_ns]),
        np.concatenate([route.starts[kept], rest.starts]),
        np.concatenate([route.twists[kept], rest.twists]),
    )
