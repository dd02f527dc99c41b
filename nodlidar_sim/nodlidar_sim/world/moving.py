"""Objects that move in a scene, such as people."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.bundles import bundled, Bundles, MIDDLE, RAYS
from nodlidar_sim.world.planar import rotate, to_child
from nodlidar_sim.world.raycast import Echoes, PLAIN, Surfaces, surfaces_of
from nodlidar_sim.world.route import Plan, Route
from nodlidar_sim.world.shapes import Shape
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """An object that moves over the floor, before its motion begins.

    Attributes
    ----------
    shapes
        In its own frame, which is level.
    start
        Initial x [m], y [m], yaw [rad] of that frame in the world.
    plan
        Its motion; forward is x of its frame.
    brightness
        0 to 1.
    """

    shapes: tuple[Shape, ...]
    start: tuple[float, float, float]
    plan: Plan
    brightness: float = PLAIN

    def moving(self, start_ns: int) -> MovingSurfaces:
        """Return its surfaces, for a start of the motion at a time [ns]."""
        surfaces = surfaces_of(self.shapes, [self.brightness] * len(self.shapes))
        return MovingSurfaces(surfaces, self.plan.route(self.start, start_ns))


@dataclass(frozen=True, slots=True, eq=False)
class MovingSurfaces:
    """Surfaces in a frame that follows a route; rays hit them at their instantaneous pose."""

    surfaces: Surfaces
    route: Route

    def distances(self, origins: Array, directions: Array, times_ns: Times) -> Array:
        """Return the range of each ray at its time [ns], shape (n,); see Surfaces."""
        bundles, times = Bundles(origins.T, directions.T), bundled(times_ns)
        nearest = np.full(times.shape, np.inf)
        which = np.flatnonzero(bundles.in_view(*self._ball(times)))
        if len(which):
            starts, ways = bundles.rays(which)
            poses = self.route.poses(times[which].ravel())
            own = to_child(starts.T, poses), rotate(ways.T, -poses[:, 2])
            nearest[which] = self.surfaces.distances(*own).reshape(-1, RAYS)
        return nearest.ravel()[: len(origins)]

    def echoes(self, origins: Array, directions: Array, times_ns: Times) -> Echoes:
        """Return what each ray (n, 3) hits at its time [ns], shape (n,); see Surfaces."""
        poses = self.route.poses(times_ns)
        return self.surfaces.echoes(to_child(origins, poses), rotate(directions, -poses[:, 2]))

    def surface_distance(self, points: Array, times_ns: Times) -> Array:
        """Return the distance [m] from points (m, 3) at times [ns], (m,) or (1,); shape (m,)."""
        return self.surfaces.surface_distance(to_child(points, self.route.poses(times_ns)))

    def _ball(self, times: Times) -> tuple[Array, Array]:
        """Return a ball that contains them during each bundle of times, for Bundles.in_view.

        Its centre is above the origin of their frame, so they stay in it when the frame rotates.
        """
        middle = times[:, MIDDLE]
        apart = np.abs(times - middle[:, None]).max(axis=-1) / NS_PER_S
        x, y, _ = self.route.poses(middle).T
        height, radius = self.surfaces.upright_ball
        return np.stack([x, y, np.full_like(x, height)]), radius + self.route.top_speed * apart
