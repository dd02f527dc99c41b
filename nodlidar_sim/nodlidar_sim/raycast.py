"""Many rays against many surfaces."""

from collections.abc import Iterable, Iterator, Sequence

from nodlidar_sim.shapes import Plane, Shape, Solid
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SLACK = 1e-9  # of the bounding spheres [m2], against rounding: squared distances are subtracted


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
        self._centers = np.array([s.center for s in self._solids]).reshape(-1, 3)
        self._radii = np.array([s.bounding_radius for s in self._solids])

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
        nearest = np.full(len(origins), np.inf)
        for plane in self._planes:
            np.minimum(nearest, plane.intersect(origins, directions), out=nearest)
        for solid, rays in zip(self._solids, self._in_view(origins, directions), strict=True):
            if len(rays):
                hits = solid.intersect(origins[rays], directions[rays])
                nearest[rays] = np.minimum(nearest[rays], hits)
        return nearest

    def surface_distance(self, points: Array) -> Array:
        """Return the exact distance [m] from points (m, 3) to the nearest surface, inf if none.

        It is unsigned: a point within a box is as far from its faces as it would have to move.
        """
        nearest = np.full(len(points), np.inf)
        for shape in self._shapes:
            np.minimum(nearest, shape.distance(points), out=nearest)
        return nearest

    def _in_view(self, origins: Array, directions: Array) -> Iterator[NDArray[np.intp]]:
        """Yield, for each solid, the rays that pass through its bounding sphere.

        With the sphere's centre seen from the ray's origin at m, the ray's line passes it at the
        squared distance m.m - (m.d)^2; both products come out of one matrix product for all.
        """
        along = self._centers @ directions.T - np.einsum('ij,ij->i', origins, directions)
        squared = np.einsum('ij,ij->i', origins, origins) - 2.0 * (self._centers @ origins.T)
        squared += np.einsum('ij,ij->i', self._centers, self._centers)[:, None]
        squared -= along**2
        hit = squared <= (self._radii**2 + _SLACK)[:, None]
        hit &= along >= -self._radii[:, None]
        return (np.flatnonzero(row) for row in hit)


def surfaces_of(shapes: Sequence[Shape]) -> Surfaces:
    """Return the surfaces of shapes of any kind."""
    planes = [shape for shape in shapes if isinstance(shape, Plane)]
    solids = [shape for shape in shapes if not isinstance(shape, Plane)]
    return Surfaces(planes, solids)  # type: ignore[arg-type]
