"""Casts many rays at many surfaces."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

from nodlidar_common.arrays import Array
from nodlidar_sim.world.bundles import Bundles, RAYS
from nodlidar_sim.world.shapes import Plane, Shape, Solid
import numpy as np
from numpy.typing import NDArray

PLAIN = 0.8  # brightness of a plain wall: diffuse reflectance of white paint in the near infrared
_STEP_BACK = 1e-3  # m


class Echoes(NamedTuple):
    """What rays hit first.

    Attributes
    ----------
    ranges
        Distance to the first surface [m], shape (n,); inf for a ray that hits none.
    brightness
        Of that surface, 0 (black) to 1 (white), shape (n,); 0 if there is none.
    cosine
        Of the angle between the ray and the normal of the surface, shape (n,); 0 if there is none.
    """

    ranges: Array
    brightness: Array
    cosine: Array


class Surfaces:
    """All surfaces of a scene, in one frame.

    Parameters
    ----------
    planes
        Infinite surfaces, tested with every ray.
    solids
        Surfaces with a bounding sphere, tested only with bundles of rays that have it in view.
    brightness
        Of the planes, then of the solids; by default that of a plain wall.
    """

    def __init__(
        self,
        planes: Iterable[Plane],
        solids: Iterable[Solid],
        brightness: Sequence[float] | None = None,
    ) -> None:
        self._planes, self._solids = tuple(planes), tuple(solids)
        self._shapes: tuple[Shape, ...] = (*self._planes, *self._solids)
        plain = np.full(len(self._shapes), PLAIN)
        self._brightness = plain if brightness is None else np.array(brightness)
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

    def echoes(self, origins: Array, directions: Array) -> Echoes:
        """Return what each ray (n, 3) hits first; parameters as of `distances`."""
        starts, ways = _rows(origins), _rows(directions)
        nearest, first = np.full(len(origins), np.inf), np.zeros(len(origins), dtype=np.intp)
        for number, which, hits in self._hits(starts, ways):
            closer = hits < nearest[which]
            nearest[which[closer]], first[which[closer]] = hits[closer], number
        brightness, cosine = np.zeros_like(nearest), np.zeros_like(nearest)
        for number, shape in enumerate(self._shapes):
            which = np.flatnonzero((first == number) & np.isfinite(nearest))
            if len(which):
                brightness[which] = self._brightness[number]
                back = starts[:, which] + (nearest[which] - _STEP_BACK) * ways[:, which]
                cosine[which] = np.minimum(shape.distance(back) / _STEP_BACK, 1.0)
        return Echoes(nearest, brightness, cosine)

    def surface_distance(self, points: Array) -> Array:
        """Return the exact distance [m] of points (m, 3) from the nearest surface, shape (m,).

        The distance is unsigned, also for a point inside a box; inf without a surface.
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

    def _hits(self, starts: Array, ways: Array) -> Iterator[tuple[int, NDArray[np.intp], Array]]:
        """Yield the number of a shape, rays that may hit it and their distances to it."""
        every = np.arange(starts.shape[1])
        for number, plane in enumerate(self._planes):
            yield number, every, plane.intersect(starts, ways)
        if self._solids:
            in_view = Bundles(starts, ways).in_view(self._centers, self._radii)
            for number, seen in enumerate(in_view, len(self._planes)):
                which = np.flatnonzero(np.repeat(seen, RAYS)[: len(every)])
                if len(which):
                    hits = self._shapes[number].intersect(starts[:, which], ways[:, which])
                    yield number, which, hits

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


def surfaces_of(shapes: Sequence[Shape], brightness: Sequence[float] | None = None) -> Surfaces:
    """Return the surfaces of shapes of any kind, with the brightness of each or a plain wall's."""
    bright = [PLAIN] * len(shapes) if brightness is None else brightness
    entries = sorted(zip(shapes, bright, strict=True), key=lambda entry: _is_solid(entry[0]))
    planes = [shape for shape, _ in entries if not _is_solid(shape)]
    solids = [shape for shape, _ in entries if _is_solid(shape)]
    return Surfaces(planes, solids, [each for _, each in entries])  # type: ignore[arg-type]


def _is_solid(shape: Shape) -> bool:
    return not isinstance(shape, Plane)
