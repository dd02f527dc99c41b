"""Many rays against many surfaces."""

from collections.abc import Iterable, Sequence

from nodlidar_sim.shapes import Plane, Shape, Solid
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SLACK = 1e-9  # of the bounding spheres [m2], since squared distances are subtracted


class Surfaces:
    """All surfaces of a scene, in one frame.

    Parameters
    ----------
    planes
        Surfaces without an end, which any ray may meet.
    solids
        Surfaces that lie within a sphere: only the rays that pass through it are tried.
    """

    def __init__(self, planes: Iterable[Plane], solids: Iterable[Solid]) -> None:
        self._planes, self._solids = tuple(planes), tuple(solids)
        self._shapes: tuple[Shape, ...] = (*self._planes, *self._solids)

    def distances(self, origins: Array, directions: Array) -> Array:
        """Return how far each ray gets.

        Parameters
        ----------
        origins, directions
            Rays, shape (n, 3) each [m]; the directions have the length 1.

        Returns
        -------
        Distance to the first surface [m], shape (n,); inf for a ray that meets none.
        """
        starts, ways = _rows(origins), _rows(directions)
        nearest = np.full(len(origins), np.inf)
        for plane in self._planes:
            np.minimum(nearest, plane.intersect(starts, ways), out=nearest)
        for solid in self._solids:
            rays = _in_view(solid, starts, ways)
            if len(rays):
                hits = solid.intersect(starts[:, rays], ways[:, rays])
                nearest[rays] = np.minimum(nearest[rays], hits)
        return nearest

    def surface_distance(self, points: Array) -> Array:
        """Return the exact distance [m] from points (m, 3) to the nearest surface, inf if none.

        It is unsigned: a point within a box is as far from its faces as it would have to move.
        """
        rows = _rows(points)
        nearest = np.full(len(points), np.inf)
        for shape in self._shapes:
            np.minimum(nearest, shape.distance(rows), out=nearest)
        return nearest


def _in_view(solid: Solid, starts: Array, ways: Array) -> NDArray[np.intp]:
    """Return which rays (3, n) pass through the bounding sphere of a solid.

    With the sphere's centre at m from the start of a ray, the ray's line passes the centre at the
    squared distance m.m - (m.d)^2, beside the point m.d along it.
    """
    x, y, z = solid.center[:, None] - starts
    radius = solid.bounding_radius
    along = x * ways[0] + y * ways[1] + z * ways[2]
    squared = x * x + y * y + z * z - along * along
    return np.flatnonzero((squared <= radius**2 + _SLACK) & (along >= -radius))


def _rows(vectors: Array) -> Array:
    """Return vectors (n, 3) as rows (3, n)."""
    return np.ascontiguousarray(vectors.T)


def surfaces_of(shapes: Sequence[Shape]) -> Surfaces:
    """Return the surfaces of shapes of any kind."""
    planes = [shape for shape in shapes if isinstance(shape, Plane)]
    solids = [shape for shape in shapes if not isinstance(shape, Plane)]
    return Surfaces(planes, solids)  # type: ignore[arg-type]
