"""Clouds of convex rooms, all of whose walls can be seen from anywhere in them."""

from nodlidar_mapper.geometry.poses import inverse, moved
from nodlidar_mapper.geometry.seen import Seen
import numpy as np

# Corners [m]. No turn makes the first one fit itself; half a turn does so with the second one.
CROOKED = np.array([(-4.0, -3.0), (4.5, -2.5), (5.0, 1.5), (1.0, 4.0), (-3.5, 2.0)])
OBLONG = np.array([(-5.0, -2.5), (5.0, -2.5), (5.0, 2.5), (-5.0, 2.5)])
HEIGHT = 2.0


def cloud(corners, pose, seed=0, count=4000, noise=0.005):
    """Return points on the walls of a room as seen from a pose in it, with noise [m], (n, 3)."""
    rng = np.random.default_rng(seed)
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    wall = rng.choice(len(corners), count, p=lengths / lengths.sum())
    along = rng.uniform(size=(count, 1))
    plane = corners[wall] + along * sides[wall] + rng.normal(0.0, noise, (count, 2))
    points = np.column_stack([plane, rng.uniform(0.0, HEIGHT, count)])
    return moved(inverse(pose), points)


def seen_from_origin(points):
    """Return points as seen by a lidar at the origin of their frame."""
    return Seen(points, np.zeros_like(points))


def distance_inside(corners, points):
    """Return how far points (n, 2) or (n, 3) are inside a room [m], (n,); negative outside."""
    sides = np.roll(corners, -1, axis=0) - corners
    inward = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    inward /= np.linalg.norm(sides, axis=1)[:, None]
    offsets = points[:, None, :2] - corners
    return np.einsum('nki,ki->nk', offsets, inward).min(axis=1)
