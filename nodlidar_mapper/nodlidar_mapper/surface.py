"""Surfaces as points with normals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from nodlidar_mapper.poses import Array, moved
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

NEIGHBOURS = 14
RADIUS = 0.35  # of the neighbours that determine a normal [m]
LEAST_NEIGHBOURS = 6
THICKNESS = 0.03  # of the neighbours off their plane, RMS, at most [m]
LEAST_WIDTH = 0.04  # of the neighbours within their plane, RMS, in each direction [m]


@dataclass(frozen=True, eq=False)
class Surface:
    """Points on surfaces.

    Attributes
    ----------
    points, normals
        Points [m] and unit normals, shape (n, 3).
    """

    points: Array
    normals: Array

    @classmethod
    def joined(cls, parts: list[Surface]) -> Surface:
        """Return the points of several surfaces as one."""
        empty = np.empty((0, 3))
        return cls(
            np.concatenate([empty, *(part.points for part in parts)]),
            np.concatenate([empty, *(part.normals for part in parts)]),
        )

    @cached_property
    def tree(self) -> cKDTree:
        """Tree to look for the nearest points."""
        return cKDTree(self.points, balanced_tree=False, compact_nodes=False)

    def moved(self, pose: Array) -> Surface:
        """Return the surface of the frame with a pose in its parent frame."""
        return Surface(moved(pose, self.points), self.normals @ pose[:3, :3].T)

    def __getitem__(self, chosen: NDArray[np.bool_]) -> Surface:
        return Surface(self.points[chosen], self.normals[chosen])


def surface_of(points: Array, around: Array) -> Surface:
    """Return those of the points (n, 3) that lie on a plane with the points around (m, 3) [m]."""
    if len(around) < LEAST_NEIGHBOURS or not len(points):
        return Surface(np.empty((0, 3)), np.empty((0, 3)))
    tree = cKDTree(around, balanced_tree=False, compact_nodes=False)
    distance, nearest = tree.query(points, k=NEIGHBOURS, distance_upper_bound=RADIUS)
    near = np.isfinite(distance)
    count = np.maximum(near.sum(axis=1), 1)
    neighbours = around[np.minimum(nearest, len(around) - 1)] - points[:, None, :]
    neighbours *= near[:, :, None]
    middle = neighbours.sum(axis=1) / count[:, None]
    products = np.einsum('nki,nkj->nij', neighbours, neighbours) / count[:, None, None]
    spread, axes = np.linalg.eigh(products - middle[:, :, None] * middle[:, None, :])
    spread = np.sqrt(np.maximum(spread, 0.0))
    flat = (spread[:, 0] < THICKNESS) & (spread[:, 1] > LEAST_WIDTH) & (count >= LEAST_NEIGHBOURS)
    normals = axes[:, :, 0]
    # The plane goes through the middle of the neighbours, which is less noisy than the point.
    off = np.einsum('ni,ni->n', middle, normals)
    flat &= np.abs(off) < 2.0 * THICKNESS
    return Surface((points + off[:, None] * normals)[flat], normals[flat])


def thinned(points: Array, spacing: float) -> Array:
    """Return one of the points (n, 3) in each cube of an edge [m]."""
    cubes = np.floor(points / spacing).astype(np.int64)
    keys = (cubes[:, 0] * 73_856_093) ^ (cubes[:, 1] * 19_349_663) ^ (cubes[:, 2] * 83_492_791)
    _, first = np.unique(keys, return_index=True)
    return np.asarray(points[np.sort(first)])
