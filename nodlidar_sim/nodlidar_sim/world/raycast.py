"""Casts many rays at many surfaces."""

from collections.abc import Iterable, Sequence
from functools import cached_property

from nodlidar_sim.world.bundles import Bundles, RAYS
from nodlidar_sim.world.shapes import Plane, Shape, Solid
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Surfaces:
    """All surfaces of a scene, in one frame.

    Parameters
    ----------
    planes
        Infinite surfaces, tested with every ray.
    solids
        Surfaces with a bounding sphere, tested only with bundles of rays that have it in view.
    """

    def __init__(self, planes: Iterable[Plane], solids: Iterable[Solid]) -> None:
        self._planes, self._solids = tuple(planes), tuple(solids)
        self._shapes: tuple[Shape, ...] = (*self._planes, *self._solids)
        self._centers = np.array([solid.center for solid in self._solids]).T[..., None]
        self._radii = np.array([[solid.bounding_radius] for solid in self._solids])

    def distances(self, origins: Array, directions: Array) -> Array:
        """Return the range of each ray.

        Parameters
        ----------
        origins, directions
            Rays, shape (n, 3) each [m]; the directions have the length 1.

        Returns
        -------
        Distance to the first surface [m], shape (n,); inf for a ray that hits none.
        """
        starts, ways = _rows(origins), _rows(directions)
        nearest = np.full(len(origins), np.inf)
        for plane in self._planes:
            np.minimum(nearest, plane.intersect(starts, ways), out=nearest)
        if self._solids:
            np.minimum(nearest, self._solid_distances(starts, ways), out=nearest)
        return nearest

    def surface_distance(self, points: Array) -> Array:
        """Return the exact distance [m] from points (m, 3) to the nearest surface, inf if none.

        The distance is unsigned, also for a point inside a box.
        """
        rows = _rows(points)
        nearest = np.full(len(points), np.inf)
        for shape in self._shapes:
            np.minimum(nearest, shape.distance(rows), out=nearest)
        return nearest

    @cached_property
    def upright_ball(self) -> tuple[float, float]:
        """Height and radius [m] of a ball, centred on the z axis, around all; inf with planes."""
        if self._planes:
            return 0.0, np.inf
        centers, radii = self._centers[..., 0], self._radii[:, 0]
        height = float(centers[2].mean())
        apart = np.linalg.norm(centers - [[0.0], [0.0], [height]], axis=0)
        return height, float((apart + radii).max())

    def _solid_distances(self, starts: Array, ways: Array) -> Array:
        bundles = Bundles(starts, ways)
        nearest = np.full((len(bundles), RAYS), np.inf)
        in_view = bundles.in_view(self._centers, self._radii)
        for solid, seen in zip(self._solids, in_view, strict=True):
            which = np.flatnonzero(seen)
            if len(which):
                hits = solid.intersect(*bundles.rays(which)).reshape(-1, RAYS)
                nearest[which] = np.minimum(nearest[which], hits)
        return nearest.ravel()[: starts.shape[1]]


def _rows(vectors: Array) -> Array:
    """Return vectors (n, 3) as rows (3, n)."""
    return np.ascontiguousarray(vectors.T)


def surfaces_of(shapes: Sequence[Shape]) -> Surfaces:
    """Return the surfaces of shapes of any kind."""
    planes = [shape for shape in shapes if isinstance(shape, Plane)]
    solids = [shape for shape in shapes if not isinstance(shape, Plane)]
    return Surfaces(planes, solids)  # type: ignore[arg-type]
