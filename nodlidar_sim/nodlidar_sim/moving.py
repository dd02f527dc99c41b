"""Objects that move through a scene, such as people who walk."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_sim.base import to_child, turn
from nodlidar_sim.raycast import Surfaces, surfaces_of
from nodlidar_sim.route import Plan, Route
from nodlidar_sim.shapes import Shape
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
        poses = self.route.poses(times_ns)
        own_directions = turn(directions, -poses[:, 2])
        return self.surfaces.distances(to_child(origins, poses), own_directions)

    def surface_distance(self, points: Array, times_ns: Times) -> Array:
        """Return how far points (m, 3) are from them [m] at times [ns] of shape (m,) or (1,)."""
        return self.surfaces.surface_distance(to_child(points, self.route.poses(times_ns)))
