"""Clouds of rooms. Of convex ones, all walls can be seen from anywhere in them."""

from nodlidar_mapper.geometry.poses import inverse, moved
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe
import numpy as np

# Corners [m]. No turn makes the first one fit itself; half a turn does so with the second one.
CROOKED = np.array([(-4.0, -3.0), (4.5, -2.5), (5.0, 1.5), (1.0, 4.0), (-3.5, 2.0)])
OBLONG = np.array([(-5.0, -2.5), (5.0, -2.5), (5.0, 2.5), (-5.0, 2.5)])
# Half a turn makes each end and each niche of the hall fit the other, but not the way between.
HALL = [(0.0, -2.0), (12.5, -2.0), (12.5, -3.0), (14.0, -3.0), (14.0, -2.0), (22.0, -2.0)]
HALL += [(22.0, 2.0), (7.5, 2.0), (7.5, 3.0), (6.0, 3.0), (6.0, 2.0), (0.0, 2.0)]
HALL = np.array(HALL)
HEIGHT = 2.0
HERE, NOTHING = np.eye(4), Surface.joined([])


def cloud(corners, pose, seed=0, count=4000, noise=0.005, reach=np.inf):
    """Return points on the walls of a room as seen from a pose in it, with noise [m], (n, 3).

    Those beyond a reach [m], and on the backs of walls, are not seen.
    """
    rng = np.random.default_rng(seed)
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    wall = rng.choice(len(corners), count, p=lengths / lengths.sum())
    along = rng.uniform(size=(count, 1))
    plane = corners[wall] + along * sides[wall] + rng.normal(0.0, noise, (count, 2))
    points = np.column_stack([plane, rng.uniform(0.0, HEIGHT, count)])
    way = pose[:2, 3] - plane
    faces = sides[wall, 0] * way[:, 1] > sides[wall, 1] * way[:, 0]
    return moved(inverse(pose), points[faces & (np.hypot(*way.T) < reach)])


def seen_from_origin(points):
    """Return points as seen by a lidar at the origin of their frame."""
    return Seen(points, np.zeros_like(points))


def keyframe_of(points, pose=HERE, surface=NOTHING, stamp_ns=0):
    """Return a keyframe of points as seen from the origin of its frame."""
    return Keyframe(stamp_ns, pose, surface, seen_from_origin(points))


def distance_inside(corners, points):
    """Return how far points (n, 2) or (n, 3) are inside a room [m], (n,); negative outside."""
    sides = np.roll(corners, -1, axis=0) - corners
    inward = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    inward /= np.linalg.norm(sides, axis=1)[:, None]
    offsets = points[:, None, :2] - corners
    return np.einsum('nki,ki->nk', offsets, inward).min(axis=1)
