"""The spot of a beam: rays in its cone, and what they return together."""

from __future__ import annotations

import math
from typing import NamedTuple

from nodlidar_common.arrays import Array
from nodlidar_sim.world.raycast import Echoes
import numpy as np

_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


class Spots(NamedTuple):
    """What beams return.

    Attributes
    ----------
    ranges
        Mean range of what each spot covers, weighted by the echo [m], shape (n,); inf without a
        surface.
    echo
        Brightness times cosine of incidence by range squared, averaged over the spot [1/m^2],
        shape (n,).
    """

    ranges: Array
    echo: Array


def disc(count: int) -> Array:
    """Return points spread evenly over the unit disc, shape (count, 2).

    They are on Fermat's spiral, each with an equal share of the area (Vogel, "A better way to
    construct the sunflower head", Mathematical Biosciences 44, 1979).
    """
    number = np.arange(count)
    radius, angle = np.sqrt((number + 0.5) / count), number * _GOLDEN_ANGLE
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return np.asarray(points - points.mean(axis=0))


def rim(count: int) -> Array:
    """Return points on the unit circle, shape (count, 2)."""
    angle = np.arange(count) * (math.tau / count)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def cone(directions: Array, half_angle: float, points: Array) -> Array:
    """Return rays in cones.

    Parameters
    ----------
    directions
        Axes of the cones, shape (n, 3), of length 1.
    half_angle
        Of the cones [rad], small.
    points
        Of the unit disc, shape (k, 2).

    Returns
    -------
    Directions of length 1, shape (n, k, 3).
    """
    level = np.abs(directions[:, 2:]) < 0.9
    across = np.cross(directions, np.where(level, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(across, directions)
    x, y = math.tan(half_angle) * points.T[..., None]
    rays = directions[:, None] + x * across[:, None] + y * up[:, None]
    return np.asarray(rays / np.linalg.norm(rays, axis=2, keepdims=True))


def straddles(centre: Array, around: Array, half_angle: float, tolerance: float) -> Array:
    """Return which spots cover more than one plane, shape (n,).

    Parameters
    ----------
    centre
        Range of the middle of each spot [m], shape (n,).
    around
        Ranges at points of its rim, shape (n, k); point i + k/2 is opposite of point i.
    half_angle
        Of the cone [rad].
    tolerance
        Deviation from a plane that does not matter [m].

    Notes
    -----
    On a plane, the inverse of the range is linear over the image plane. So the inverse ranges of
    opposite points of the rim have the mean cos(half_angle) / centre.
    """
    half = around.shape[1] // 2
    with np.errstate(invalid='ignore'):
        inverse = (1.0 / around[:, :half] + 1.0 / around[:, half:]) / 2.0
        middle = math.cos(half_angle) / centre[:, None]
        apart = np.abs(inverse - middle) > tolerance * inverse * middle
    return np.asarray(apart.any(axis=1))


def merged(echoes: Echoes, excess: Array) -> Spots:
    """Return what spots return whose parts are seen by rays of equal shares, shape (n, k).

    A lidar that measures by phase adds up waves of the amplitudes and phases of all parts. Their
    sum has the phase of the weighted mean as long as the parts differ by a small share of the
    ambiguity (3 m for light modulated at 50 MHz); beyond, this is simplified.

    Parameters
    ----------
    echoes
        Of the rays.
    excess
        By how much longer each is measured [m], shape (n, k).
    """
    weight = echo_of(echoes)
    total = weight.sum(axis=1)
    apparent = np.where(weight > 0.0, echoes.ranges + excess, 0.0)
    with np.errstate(invalid='ignore', divide='ignore'):
        mean = (weight * apparent).sum(axis=1) / total
    return Spots(np.where(total > 0.0, mean, np.inf), total / weight.shape[1])


def echo_of(echoes: Echoes) -> Array:
    """Return the echo [1/m^2] of each ray, of the shape of the ranges; 0 without a surface.

    It is the brightness times the cosine of incidence by the square of the range.
    """
    return np.asarray(echoes.brightness * echoes.cosine / echoes.ranges**2)
