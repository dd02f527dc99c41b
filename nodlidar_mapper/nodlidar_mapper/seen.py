"""Points of clouds, with the places of the lidar that saw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_mapper.poses import Array, moved
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Points as seen: a wall has two sides, and a beam ends on the one that faces the lidar.

    Attributes
    ----------
    points, origins
        Points, and where the lidar was when it saw each [m], shape (n, 3).
    """

    points: Array
    origins: Array

    @classmethod
    def joined(cls, parts: Sequence[Seen]) -> Seen:
        """Return the points of several clouds as one."""
        return cls(
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.origins for part in parts]),
        )

    @property
    def towards(self) -> Array:
        """Vectors from the points to the lidar [m], shape (n, 3)."""
        return self.origins - self.points

    def moved(self, pose: Array) -> Seen:
        """Return the points of the frame with a pose in its parent frame."""
        return Seen(moved(pose, self.points), moved(pose, self.origins))

    def thinned(self, spacing: float) -> Seen:
        """Return one of the points in each cube of an edge [m]."""
        cubes = np.floor(self.points / spacing).astype(np.int64)
        keys = (cubes[:, 0] * 73_856_093) ^ (cubes[:, 1] * 19_349_663) ^ (cubes[:, 2] * 83_492_791)
        _, first = np.unique(keys, return_index=True)
        return self[np.sort(first)]

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Seen:
        return Seen(self.points[chosen], self.origins[chosen])
