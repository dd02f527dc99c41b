"""Objects that move through a scene, such as people who walk."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.nod import NS_PER_S
from nodlidar_sim.world.base import to_child, turn
from nodlidar_sim.world.bundles import bundled, Bundles, MIDDLE, RAYS
from nodlidar_sim.world.raycast import Surfaces, surfaces_of
from nodlidar_sim.world.route import Plan, Route
from nodlidar_sim.world.shapes import Shape
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Times = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """An object that will move over the floor.

    Attributes
    ----------
    shapes
        In its own frame, which is level.
    start
        x [m], y [m], yaw [rad] of that frame in the world at first.
    plan
        How it moves; ahead is its x.
    """

    shapes: tuple[Shape, ...]
    start: tuple[float, float, float]
    plan: Plan

    def moving(self, start_ns: int) -> MovingSurfaces:
        """Return its surfaces when it leaves the start at start_ns."""
        return MovingSurfaces(surfaces_of(self.shapes), self.plan.route(self.start, start_ns))


@dataclass(frozen=True, slots=True, eq=False)
class MovingSurfaces:
    """Surfaces, given in a frame that follows a route; they are met where they then are."""

    surfaces: Surfaces
    route: Route

    def distances(self, origins: Array, directions: Array, times_ns: Times) -> Array:
        """Return how far each ray gets, as Surfaces does, each at its time [ns], shape (n,)."""
        bundles, times = Bundles(origins.T, directions.T), bundled(times_ns)
        nearest = np.full(times.shape, np.inf)
        which = np.flatnonzero(bundles.in_view(*self._ball(times)))
        if len(which):
            starts, ways = bundles.rays(which)
            poses = self.route.poses(times[which].ravel())
            own = to_child(starts.T, poses), turn(ways.T, -poses[:, 2])
            nearest[which] = self.surfaces.distances(*own).reshape(-1, RAYS)
        return nearest.ravel()[: len(origins)]

    def surface_distance(self, points: Array, times_ns: Times) -> Array:
        """Return how far points (m, 3) are from them [m] at times [ns] of shape (m,) or (1,)."""
        return self.surfaces.surface_distance(to_child(points, self.route.poses(times_ns)))

    def _ball(self, times: Times) -> tuple[Array, Array]:
        """Return the ball that they do not leave in each bundle of times, for Bundles.in_view.

        Its centre is above the origin of their frame, so turning does not move them out of it.
        """
        middle = times[:, MIDDLE]
        apart = np.abs(times - middle[:, None]).max(axis=-1) / NS_PER_S
        x, y, _ = self.route.poses(middle).T
        height, radius = self.surfaces.upright_ball
        return np.stack([x, y, np.full_like(x, height)]), radius + self.route.top_speed * apart
