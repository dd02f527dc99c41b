"""Bundles of rays, so that solids out of view of a whole bundle are excluded at once."""

from __future__ import annotations

from typing import TypeVar

from nodlidar_common.arrays import Array, Mask
from nodlidar_sim.world.shapes import dot
import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.intp]
_Kind = TypeVar('_Kind', bound=np.generic)

RAYS = 31  # in a bundle: 682 beams are 22 of them
MIDDLE = RAYS // 2
_SLACK = 1e-6  # of the cosines, far above their rounding errors


def bundled(values: NDArray[_Kind]) -> NDArray[_Kind]:
    """Return values (..., n) in bundles, shape (..., b, RAYS), padded with the last value."""
    missing = -values.shape[-1] % RAYS
    if missing:
        last = np.repeat(values[..., -1:], missing, axis=-1)
        values = np.concatenate([values, last], axis=-1)
    return values.reshape(*values.shape[:-1], -1, RAYS)


class Bundles:
    """Bundles of consecutive rays, such as the beams of a lidar.

    All rays of a bundle begin in a ball and point into a cone about the middle ray. Any rays are
    allowed: the more they differ, the more is in view of their bundle.

    Parameters
    ----------
    starts, ways
        Origins and directions of rays as rows, shape (3, n) each [m]; the directions have the
        length 1.

    Attributes
    ----------
    starts, ways
        The same, shape (3, b, RAYS).
    """

    def __init__(self, starts: Array, ways: Array) -> None:
        self.starts, self.ways = bundled(starts), bundled(ways)
        self._center, self._axis = self.starts[..., MIDDLE], self.ways[..., MIDDLE]
        offset = self.starts - self._center[..., None]
        self._radius = np.sqrt(dot(offset, offset).max(axis=-1))
        self._cosine = dot(self.ways, self._axis[..., None]).min(axis=-1) - _SLACK
        self._sine = np.sqrt(1.0 - np.clip(self._cosine, 0.0, 1.0) ** 2)

    def __len__(self) -> int:
        return int(self.starts.shape[1])

    def rays(self, bundles: Numbers) -> tuple[Array, Array]:
        """Return the origins and directions in some bundles, shape (3, RAYS * k) each."""
        starts, ways = self.starts.take(bundles, axis=1), self.ways.take(bundles, axis=1)
        return starts.reshape(3, -1), ways.reshape(3, -1)

    def in_view(self, centers: Array, radii: Array) -> Mask:
        """Return which balls [m] a ray of each bundle could hit.

        Parameters
        ----------
        centers, radii
            Shape (3, s, 1) and (s, 1); or (3, b) and (b,) for one ball per bundle.

        Returns
        -------
        Shape (s, b), or (b,).

        Notes
        -----
        If a ray that begins within rho of a point o hits a ball of radius r, the parallel ray from
        o hits the concentric ball of radius R = r + rho. With m the vector from o to the centre,
        the direction of that ray is at most asin(R / |m|) from m. The cone of half-angle h about
        the axis a contains such directions if the angle from a to m is at most
        h + asin(R / |m|), that is a.m >= cos h sqrt(m.m - R^2) - R sin h. For h beyond a right
        angle, 1 in place of sin h is conservative; it includes all where the sum of the angles
        would exceed pi.
        """
        x, y, z = self._center
        ways = centers[0] - x, centers[1] - y, centers[2] - z
        reach = radii + self._radius
        tangent = dot(ways, ways) - reach * reach
        grazing = self._cosine * np.sqrt(np.maximum(tangent, 0.0)) - self._sine * reach
        return np.asarray((dot(ways, self._axis) >= grazing) | (tangent <= 0.0))
