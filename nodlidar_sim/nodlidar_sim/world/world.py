"""The ranges of beams, each at its own instant, with the pitch and base pose at that instant."""

from __future__ import annotations

import math

from nodlidar_common.arrays import Array, Times
from nodlidar_sim.world.nod_motion import Motion
from nodlidar_sim.world.odometry import Base
from nodlidar_sim.world.planar import rotate, to_parent, to_space
from nodlidar_sim.world.raycast import Echoes
from nodlidar_sim.world.scene import Scene
import numpy as np


class World:
    """A scene, the nod's motion and the base's motion.

    Parameters
    ----------
    scene
        Surfaces and the sensor's mount.
    motion
        Pitch at any instant, positive up.
    base
        Pose of base_link in the world at any instant; by default the scene's route from start_ns.
    start_ns
        When moving objects leave their start [ns].
    """

    def __init__(
        self, scene: Scene, motion: Motion, base: Base | None = None, start_ns: int = 0
    ) -> None:
        self.scene = scene
        self.motion = motion
        self.base = scene.route(start_ns) if base is None else base
        self._moving = [mover.moving(start_ns) for mover in scene.movers.values()]

    def ranges(self, times_ns: Times, azimuth: Array, elevation: float = 0.0) -> Array:
        """Return the true range of beams [m], shape (n,), inf without a surface.

        Parameters
        ----------
        times_ns
            Time of each beam [ns], shape (n,).
        azimuth
            Angle of each beam in the scan plane [rad], shape (n,).
        elevation
            Angle at which all rise out of that plane [rad].
        """
        return self.distances(*self.rays(times_ns, azimuth, elevation), times_ns)

    def distances(self, origins: Array, directions: Array, times_ns: Times) -> Array:
        """Return the true range [m] of rays in the world (n, 3) at times [ns], shape (n,)."""
        nearest = self.scene.surfaces.distances(origins, directions)
        for moving in self._moving:
            np.minimum(nearest, moving.distances(origins, directions, times_ns), out=nearest)
        return nearest

    def echoes(self, origins: Array, directions: Array, times_ns: Times) -> Echoes:
        """Return what rays in the world (n, 3) hit first at times [ns], shape (n,)."""
        found = self.scene.surfaces.echoes(origins, directions)
        for moving in self._moving:
            other = moving.echoes(origins, directions, times_ns)
            nearer = other.ranges < found.ranges
            pairs = zip(other, found, strict=True)
            found = Echoes(*(np.where(nearer, one, two) for one, two in pairs))
        return found

    def rays(self, times_ns: Times, azimuth: Array, elevation: float = 0.0) -> tuple[Array, Array]:
        """Return the origin and the direction of each beam in the world, shape (n, 3) each.

        Origin and direction are those of the lidar in the nodding frame, rotated up by the pitch.
        """
        pitch = self.motion.position(times_ns)
        up, level = np.sin(pitch), np.cos(pitch)
        laser = self.scene.laser
        x, y, z = laser.position[:, None]
        origins = np.stack([x * level - z * up, y + 0.0 * up, x * up + z * level]).T
        flat, rise = math.cos(elevation), np.full_like(azimuth, math.sin(elevation))
        ways = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), rise])
        x, y, z = laser.rotation @ ways
        directions = np.stack([x * level - z * up, y, x * up + z * level]).T
        mount, poses = self.scene.mount, self.base.poses(times_ns)
        if len(poses) == 1:  # the base does not move
            mount = to_space(poses[0]) @ mount
            return mount.to_parent(origins), mount.directions_to_parent(directions)
        return (
            to_parent(mount.to_parent(origins), poses),
            rotate(mount.directions_to_parent(directions), poses[:, 2]),
        )

    def surface_distance(self, points: Array, times_ns: Times) -> Array:
        """Return the distance [m] of points from the nearest surface, shape (m,).

        Parameters
        ----------
        points
            In nodlidar_base_link at the time of each [m], shape (m, 3).
        times_ns
            Time of each point [ns], shape (m,) or (1,).
        """
        in_base = self.scene.mount.to_parent(points)
        in_world = to_parent(in_base, self.base.poses(times_ns))
        return self.surface_distance_in_world(in_world, times_ns)

    def surface_distance_in_world(self, points: Array, times_ns: Times) -> Array:
        """Return the same for points (m, 3) [m] in the world."""
        nearest = self.scene.surfaces.surface_distance(points)
        for moving in self._moving:
            np.minimum(nearest, moving.surface_distance(points, times_ns), out=nearest)
        return nearest
