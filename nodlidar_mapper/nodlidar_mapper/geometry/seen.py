"""Points of clouds, with the places of the lidar that saw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array, Mask
from nodlidar_mapper.geometry.poses import moved, shifted
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Points as seen: a wall has two sides, and a beam ends on the one that faces the lidar.

    Attributes
    ----------
    points, origins
        Points, and where the lidar was when it saw each [m], shape (n, 3).
    age
        Time from then to the instant of the cloud [s], shape (n,); None if that is not known.
    """

    points: Array
    origins: Array
    age: Array | None = None

    @classmethod
    def joined(cls, parts: Sequence[Seen]) -> Seen:
        """Return the points of several clouds as one, whose ages are no longer known."""
        empty = np.empty((0, 3))
        return cls(
            np.concatenate([empty, *(part.points for part in parts)]),
            np.concatenate([empty, *(part.origins for part in parts)]),
        )

    @property
    def towards(self) -> Array:
        """Vectors from the points to the lidar [m], shape (n, 3)."""
        return self.origins - self.points

    def moved(self, pose: Array) -> Seen:
        """Return the points of the frame with a pose in its parent frame."""
        return Seen(moved(pose, self.points), moved(pose, self.origins), self.age)

    def shares(self, seconds: float) -> Array:
        """Return the share (n,) of an even slip in the last seconds that was before each point.

        It is 1 for a slip that took no time.
        """
        if self.age is None or not seconds:
            return np.ones(len(self.points))
        return np.asarray(np.clip(1.0 - self.age / seconds, 0.0, 1.0))

    def slipped(self, pose: Array, slip: Array, shares: Array) -> Seen:
        """Return the points in the parent frame, after a slip that bent the cloud.

        Parameters
        ----------
        pose
            Of the cloud's frame, as if there were no slip.
        slip
            What changes that pose, shape (6,), see `corrected`.
        shares
            Of the slip, before each point, shape (n,).
        """
        changes = shares[:, None] * slip
        points, origins = (
            shifted(each @ pose[:3, :3].T, changes) + pose[:3, 3]
            for each in (self.points, self.origins)
        )
        return Seen(points, origins, self.age)

    def thinned(self, spacing: float) -> Seen:
        """Return the mean of the points in each cube of an edge [m].

        The first point in each cube would be at the edge where the beams enter it. Of the points
        near an edge, noise brings those into the cube whose range it shortens on the left of the
        lidar, and lengthens on the right: both walls of a corridor would move to the right, and
        the map would turn.
        """
        cubes = np.floor(self.points / spacing).astype(np.int64)
        keys = cubes @ np.array([1 << 42, 1 << 21, 1])
        _, cube, count = np.unique(keys, return_inverse=True, return_counts=True)

        def means(values: Array) -> Array:
            sums = [np.bincount(cube, axis) for axis in values.T]
            return np.asarray(np.stack(sums, axis=1) / count[:, None])

        age = None if self.age is None else means(self.age[:, None])[:, 0]
        return Seen(means(self.points), means(self.origins), age)

    def __getitem__(self, chosen: Mask) -> Seen:
        points, origins = (each.compress(chosen, axis=0) for each in (self.points, self.origins))
        return Seen(points, origins, None if self.age is None else self.age.compress(chosen))
