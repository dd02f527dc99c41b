"""Rigid transforms in plain Python: a translation and a quaternion (x, y, z, w)."""

import math
from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Rigid(NamedTuple):
    """Maps a point p to rotation * p + translation."""

    translation: Vector
    rotation: Quaternion


IDENTITY = Rigid((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the Hamilton product: b's rotation, then a's."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse of a unit quaternion."""
    return -q[0], -q[1], -q[2], q[3]


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Rotate a vector by a unit quaternion."""
    return multiply(multiply(q, (*v, 0.0)), conjugate(q))[:3]


def compose(a: Rigid, b: Rigid) -> Rigid:
    """Return the transform b, then a."""
    x, y, z = rotate(a.rotation, b.translation)
    tx, ty, tz = a.translation
    return Rigid((tx + x, ty + y, tz + z), multiply(a.rotation, b.rotation))


def inverse(a: Rigid) -> Rigid:
    """Return the transform that undoes a."""
    rotation = conjugate(a.rotation)
    x, y, z = rotate(rotation, a.translation)
    return Rigid((-x, -y, -z), rotation)


def interpolate(a: Rigid, b: Rigid, ratio: float) -> Rigid:
    """Return the transform at a ratio between a and b: translation linear, rotation by slerp."""
    translation = tuple(
        (1.0 - ratio) * i + ratio * j for i, j in zip(a.translation, b.translation, strict=True)
    )
    return Rigid(translation, slerp(a.rotation, b.rotation, ratio))


def slerp(a: Quaternion, b: Quaternion, ratio: float) -> Quaternion:
    """Return the rotation at a ratio between a and b, along the shorter arc."""
    if sum(i * j for i, j in zip(a, b, strict=True)) < 0.0:
        b = tuple(-j for j in b)
    # Unlike the cosine, the chord is exact near zero.
    angle = 2.0 * math.atan2(math.dist(a, b), math.hypot(*map(sum, zip(a, b, strict=True))))
    if angle == 0.0:
        return a
    weight_a = math.sin((1.0 - ratio) * angle) / math.sin(angle)
    weight_b = math.sin(ratio * angle) / math.sin(angle)
    return tuple(weight_a * i + weight_b * j for i, j in zip(a, b, strict=True))


def normalized(q: Quaternion) -> Quaternion:
    """Return the unit quaternion, with the sign that tf2 gets from a rotation matrix.

    w is positive if w**2 is above 1/4; otherwise the greatest of x, y and z is.
    """
    length = math.hypot(*q)
    leading = q[3] if q[3] ** 2 > 0.25 * length**2 else max(q[:3], key=abs)
    scale = math.copysign(length, leading)
    return tuple(i / scale for i in q)
