"""Surfaces that beams hit: planes, and the hulls of spheres, boxes and cylinders.

Every shape is a surface without thickness that is hit from both sides: a ray that starts inside a
box hits its far wall. A shape computes where a ray first hits it and its distance from a point.

Points and directions are rows x, y, z of shape (3, n), since NumPy is fastest along rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Protocol

from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.pose import Pose
import numpy as np

SMALLEST = 1e-6  # least size [m]; its square is far above rounding errors


class Shape(Protocol):
    """A surface."""

    def intersect(self, origins: Array, directions: Array) -> Array:
        """Return the distance [m] from each origin along each unit direction, inf for none.

        Origins and directions have the shape (3, n), the result has the shape (n,).
        """

    def distance(self, points: Array) -> Array:
        """Return the distance of points (3, m) from the surface [m], shape (m,); not negative."""


class Solid(Shape, Protocol):
    """A surface with a bounding sphere, which excludes most rays quickly."""

    @property
    def center(self) -> Array:
        """Centre of the bounding sphere [m], shape (3,)."""

    @property
    def bounding_radius(self) -> float:
        """Radius of the bounding sphere [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """An infinite plane through a point [m], with a normal of any length."""

    point: Array
    normal: Array

    def __post_init__(self) -> None:
        length = float(np.linalg.norm(self.normal))
        if not length >= SMALLEST:
            raise ParameterError('normal', f'at least {SMALLEST:g} long', list(self.normal))
        object.__setattr__(self, 'normal', self.normal / length)

    def intersect(self, origins: Array, directions: Array) -> Array:
        """See Shape."""
        with np.errstate(all='ignore'):
            along = dot(self.normal, self.point[:, None] - origins) / dot(self.normal, directions)
        return np.where(along > 0.0, along, np.inf)

    def distance(self, points: Array) -> Array:
        """See Shape."""
        return np.abs(dot(self.normal, points - self.point[:, None]))


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """The surface of a ball, around a centre [m]."""

    center: Array
    radius: float

    def __post_init__(self) -> None:
        _require_size('radius', self.radius)

    @property
    def bounding_radius(self) -> float:
        """See Solid."""
        return self.radius

    def intersect(self, origins: Array, directions: Array) -> Array:
        """See Shape."""
        offset = origins - self.center[:, None]
        return _first_hit(*_within_circle(offset, directions, self.radius))

    def distance(self, points: Array) -> Array:
        """See Shape."""
        beyond: Array = _length(points - self.center[:, None]) - self.radius
        return np.abs(beyond)


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """The six faces of a box, centred on its pose, of a size (x, y, z) [m]."""

    pose: Pose
    size: Array

    def __post_init__(self) -> None:
        _require_size('size', *self.size)

    @property
    def center(self) -> Array:
        """See Solid."""
        return self.pose.position

    @property
    def bounding_radius(self) -> float:
        """See Solid."""
        return float(np.linalg.norm(self.size)) / 2.0

    def intersect(self, origins: Array, directions: Array) -> Array:
        """See Shape; a ray within the plane of a face does not hit it."""
        half = self.size[:, None] / 2.0
        enter, leave = _within_slab(*_local_ray(self.pose, origins, directions), half)
        return _first_hit(enter.max(axis=0), leave.min(axis=0))

    def distance(self, points: Array) -> Array:
        """See Shape."""
        beyond = np.abs(_in_frame(self.pose, points)) - self.size[:, None] / 2.0
        return _hull_distance(beyond)


@dataclass(frozen=True, slots=True, eq=False)
class Cylinder:
    """A closed cylinder, centred on its pose, along the pose's z axis."""

    pose: Pose
    radius: float
    length: float

    def __post_init__(self) -> None:
        _require_size('radius', self.radius)
        _require_size('length', self.length)

    @property
    def center(self) -> Array:
        """See Solid."""
        return self.pose.position

    @property
    def bounding_radius(self) -> float:
        """See Solid."""
        return math.hypot(self.radius, self.length / 2.0)

    def intersect(self, origins: Array, directions: Array) -> Array:
        """See Shape; a ray within the plane of an end does not hit it."""
        offset, along = _local_ray(self.pose, origins, directions)
        enter, leave = _within_circle(offset[:2], along[:2], self.radius)
        enter_ends, leave_ends = _within_slab(offset[2], along[2], self.length / 2.0)
        return _first_hit(np.maximum(enter, enter_ends), np.minimum(leave, leave_ends))

    def distance(self, points: Array) -> Array:
        """See Shape."""
        x, y, z = _in_frame(self.pose, points)
        beyond = np.stack([np.hypot(x, y) - self.radius, np.abs(z) - self.length / 2.0])
        return _hull_distance(beyond)


def _require_size(key: str, *sizes: float) -> None:
    if not all(size >= SMALLEST for size in sizes):
        value = sizes[0] if len(sizes) == 1 else [float(size) for size in sizes]
        raise ParameterError(key, f'at least {SMALLEST:g} m', value)


def _local_ray(pose: Pose, origins: Array, directions: Array) -> tuple[Array, Array]:
    """Return origins and directions (3, n) in the frame of a pose."""
    return _in_frame(pose, origins), np.asarray(pose.rotation.T @ directions)


def _in_frame(pose: Pose, points: Array) -> Array:
    """Return points (3, n) in the frame of a pose."""
    return np.asarray(pose.rotation.T @ (points - pose.position[:, None]))


def _within_slab(offset: Array, along: Array, half: Array | float) -> tuple[Array, Array]:
    """Return where rays enter and leave |x| < half; NaN for a ray within a boundary."""
    with np.errstate(all='ignore'):
        one, other = (-half - offset) / along, (half - offset) / along
    return np.minimum(one, other), np.maximum(one, other)


def _within_circle(offset: Array, along: Array, radius: float) -> tuple[Array, Array]:
    """Return where rays enter and leave a circle or sphere around 0; NaN if they miss it.

    A ray normal to the circle's plane (along the axis of a cylinder) is always inside or outside.
    """
    speed = dot(along, along)
    towards = -dot(offset, along)
    outside = dot(offset, offset) - radius**2
    with np.errstate(all='ignore'):
        reach = np.sqrt(towards**2 - speed * outside)
        enter, leave = (towards - reach) / speed, (towards + reach) / speed
    still = speed == 0.0
    if still.any():
        ever = np.where(outside < 0.0, np.inf, np.nan)
        return np.where(still, -ever, enter), np.where(still, ever, leave)
    return enter, leave


def _first_hit(enter: Array, leave: Array) -> Array:
    """Return where rays first hit a hull that they enter and leave; inf if they miss it."""
    first = np.where(enter > 0.0, enter, leave)
    return np.where((enter <= leave) & (leave > 0.0), first, np.inf)


def _hull_distance(beyond: Array) -> Array:
    """Return the distance from a hull, by the distances (k, m) beyond each pair of its faces."""
    outside = _length(np.maximum(beyond, 0.0))
    inside = np.minimum(beyond.max(axis=0), 0.0)
    return np.asarray(np.abs(outside + inside))


def dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    """Return the scalar products (n,) of vectors (k, n)."""
    total = a[0] * b[0]
    for one, other in zip(a[1:], b[1:], strict=True):
        total = total + one * other
    return np.asarray(total)


def _length(rows: Array) -> Array:
    return np.asarray(np.sqrt(dot(rows, rows)))
