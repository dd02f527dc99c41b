"""Surfaces as points with normals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from nodlidar_common.arrays import Array, Mask
from nodlidar_mapper.geometry.linear import solved_each
from nodlidar_mapper.geometry.poses import moved
from nodlidar_mapper.geometry.seen import Seen
import numpy as np
from scipy.spatial import cKDTree

NEIGHBOURS = 20
RADIUS = 0.35  # of the neighbours that determine a normal [m]
LEAST_NEIGHBOURS = 6
THICKNESS = 0.03  # of the neighbours off their plane, RMS, at most [m]
PLACES = 8  # of the lidar, at most, from which surfaces are judged to be visible
FACING = 4  # nearest points, one of which must face the lidar
LEAST_WIDTH = 0.04  # of the neighbours within their plane, RMS, in each direction [m]
# Standard deviation of the neighbours [m], where those of curvatures are 1/m and of slopes from
# their plane 1: noise alone is not taken for a curve.
NOISE = 0.01


@dataclass(frozen=True, eq=False)
class Surface:
    """Points on surfaces.

    Attributes
    ----------
    points, normals
        Points [m] and unit normals, towards where they were seen from, shape (n, 3).
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

    def visible(self, seen: Seen) -> Surface:
        """Return the points that face any of the places that others were seen from."""
        places = seen.origins[:: max(len(seen.origins) // PLACES, 1)]
        offset = np.einsum('ni,ni->n', self.normals, self.points)
        normals = np.ascontiguousarray(self.normals.T)  # einsum is three times as fast
        return self[(np.einsum('in,pi->pn', normals, places) > offset).any(axis=0)]

    def covers(self, seen: Seen, reach: float) -> Mask:
        """Return which points (n,) have the surface within reach [m], with the side seen."""
        if not len(self.points):
            return np.zeros(len(seen.points), dtype=np.bool_)
        distance, nearest = self.tree.query(
            seen.points, k=np.arange(1, FACING + 1), distance_upper_bound=reach
        )
        normals = self.normals.take(nearest, axis=0, mode='clip')
        facing = np.einsum('nki,ni->nk', normals, seen.towards) > 0.0
        return np.asarray((facing & np.isfinite(distance)).any(axis=1))

    def __getitem__(self, chosen: Mask) -> Surface:
        return Surface(self.points.compress(chosen, axis=0), self.normals.compress(chosen, axis=0))


def surface_of(seen: Seen, around: Seen) -> Surface:
    """Return those points that lie on a surface with the points around, seen from the same side.

    The surface may be curved: a plane through the neighbours would be inside a pillar, and each
    cloud would be drawn towards what was not seen of the pillar before.
    """
    points = seen.points
    if len(around.points) < LEAST_NEIGHBOURS or not len(points):
        return Surface(np.empty((0, 3)), np.empty((0, 3)))
    tree = cKDTree(around.points, balanced_tree=False, compact_nodes=False)
    neighbours, towards, near = _neighbours(points, around, tree, NEIGHBOURS)
    fit = off, normals, spread, count = _fit(neighbours, near)
    # The sides of a thin wall are parallel: both of them show which way it faces.
    facing = _facing(normals, seen)
    both = (near & ~_faces(facing, towards)).any(axis=1)
    neighbours, towards, near = _neighbours(points[both], around, tree, 2 * NEIGHBOURS)
    near &= _faces(facing[both], towards)
    near &= np.cumsum(near, axis=1) <= NEIGHBOURS
    for of_both, of_one in zip(fit, _fit(neighbours, near), strict=True):
        of_both[both] = of_one
    flat = (spread[:, 0] < THICKNESS) & (spread[:, 1] > LEAST_WIDTH) & (count >= LEAST_NEIGHBOURS)
    flat &= np.linalg.norm(off, axis=1) < 2.0 * THICKNESS
    return Surface((points + off)[flat], _facing(normals, seen)[flat])


def _neighbours(
    points: Array, around: Seen, tree: cKDTree, most: int
) -> tuple[Array, Array, Mask]:
    """Return the ways to the points around, from these to the lidar, and which are near."""
    distance, nearest = tree.query(points, k=most, distance_upper_bound=RADIUS)
    ways = around.points.take(nearest, axis=0, mode='clip') - points[:, None, :]
    towards = around.towards.take(nearest, axis=0, mode='clip')
    return ways, towards, np.isfinite(distance)


def _faces(normals: Array, towards: Array) -> Mask:
    """Return which of the places (n, k, 3) are on the side of normals (n, 3)."""
    return np.asarray(np.einsum('nki,ni->nk', towards, normals) > 0.0)


def _facing(normals: Array, seen: Seen) -> Array:
    """Return normals (n, 3) towards the places that points were seen from."""
    away = np.einsum('ni,ni->n', normals, seen.towards) <= 0.0
    return np.asarray(np.where(away[:, None], -normals, normals))


def _fit(neighbours: Array, near: Mask) -> tuple[Array, Array, Array, Array]:
    """Return the surface at the origin of its neighbours (n, k, 3), those that are near.

    Way to it and normal (n, 3), RMS width of the neighbours along three axes, ascending, and their
    count. The surface is a quadratic over the plane of the neighbours.
    """
    chosen = neighbours * near[:, :, None]
    found = near.sum(axis=1)
    count = np.maximum(found, 1)
    middle = np.einsum('nki->ni', chosen) / count[:, None]
    products = (np.swapaxes(chosen, 1, 2) @ chosen) / count[:, None, None]
    spread, axes = np.linalg.eigh(products - middle[:, :, None] * middle[:, None, :])
    up, u, v = np.moveaxis(chosen @ axes, 2, 0)
    terms = np.stack([near, u, v, u**2 / 2.0, u * v, v**2 / 2.0], axis=1)
    known = terms @ np.swapaxes(terms, 1, 2) + NOISE**2 * np.eye(6)
    shape = solved_each(known, terms @ up[:, :, None])
    normals = axes @ np.concatenate([np.ones((len(axes), 1, 1)), -shape[:, 1:3]], axis=1)
    normals = normals[:, :, 0] / np.linalg.norm(normals, axis=1)
    return shape[:, 0] * axes[:, :, 0], normals, np.sqrt(np.maximum(spread, 0.0)), found
