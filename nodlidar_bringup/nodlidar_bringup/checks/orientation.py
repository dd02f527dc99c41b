"""How the lidar is mounted, from its own cloud: joint's sign, lever arm, which way is up.

Points are turned back into range, azimuth and pitch of their beams, and placed again as if the
joint's sign, the lever arm or both were reversed. The mount is the one with which the floor is
where the height of the nod axis says.

If no floor is seen there, walls and floor still show something. With one of both wrong, the
optical centre moves the wrong way: walls lean and the floor bends. With both wrong (the whole
sensor upside down), the cloud is an exact mirror image.

Which way is left, a cloud of a room at rest cannot show: that is left to the user.
"""

from dataclasses import dataclass, field

from nodlidar_assembler.clouds.points import nod_in_place
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Lever = tuple[float, float, float]

LEAST_POINTS = 2000
_NEAREST_X = 0.4  # [m]: beams to the sides and back hardly show the lever arm
_FLOOR_BAND = 0.10  # [m]
_SAME = 0.03  # [m]: distances and heights that count as equal
_APART = 0.1  # [rad]: pitch at which two points show how a surface runs
_COLUMN = 0.0062  # [rad]: a step of most lidars


@dataclass(frozen=True, slots=True)
class Mounting:
    """What is known of the mounting.

    Attributes
    ----------
    lever
        Position of the optical centre in the nodding frame [m]: x, y, z.
    height
        Height of the nod axis above the floor [m]: its z in base_link, which is on the floor.
    upside_down
        Whether the mount is known to be turned over.
    """

    lever: Lever
    height: float
    upside_down: bool = False


@dataclass(frozen=True, slots=True)
class Reversed:
    """What differs from the mount as it is known: the joint's sign, the lever arm."""

    joint: bool = False
    lever: bool = False


AS_KNOWN = Reversed()
ALL = (AS_KNOWN, Reversed(joint=True), Reversed(lever=True), Reversed(joint=True, lever=True))


@dataclass(frozen=True, slots=True)
class Seen:
    """What a cloud shows.

    Attributes
    ----------
    floor
        Share of the points on the floor, for each mount.
    sharpness
        How many times as many pairs of points lie on one wall or floor with the lever arm as known
        as with it reversed.
    nearest
        Range [m] of the nearest point in front, and its azimuth on the robot [rad].
    """

    floor: dict[Reversed, float] = field(default_factory=dict)
    sharpness: float = 1.0
    nearest: tuple[float, float] = (0.0, 0.0)


def seen_in(points: Array, mounting: Mounting) -> Seen | None:
    """Return what a cloud in nodlidar_base_link shows, shape (n, 3); None with too few points."""
    points = points[points[:, 0] > _NEAREST_X]
    if len(points) < LEAST_POINTS:
        return None
    range_, azimuth, pitch = beams_of(points, mounting.lever)
    x, y, z = mounting.lever
    floor, pairs = {}, {}
    for each in ALL:
        lever = (x, y, -z if each.lever else z)
        placed = points_of(range_, azimuth, -pitch if each.joint else pitch, lever)
        up = -placed[:, 2] if mounting.upside_down else placed[:, 2]
        floor[each] = float(np.mean(np.abs(up + mounting.height) < _FLOOR_BAND))
        if not each.joint:
            pairs[each] = pairs_on_surfaces(placed, azimuth, pitch)
    near, turned = int(np.argmin(range_)), -1.0 if mounting.upside_down else 1.0
    return Seen(
        floor,
        pairs[AS_KNOWN] / max(pairs[Reversed(lever=True)], 1),
        (float(range_[near]), turned * float(azimuth[near])),
    )


def beams_of(points: Array, lever: Lever) -> tuple[Array, Array, Array]:
    """Return range [m], azimuth and pitch [rad] of the beams that ended at points in front.

    The inverse of the transform of docs/model.md, for a lidar that is not turned in the nodding
    frame: the nod keeps the distance from its axis.
    """
    x, y, z = points.T
    from_axis = np.sqrt(np.maximum(x * x + z * z - lever[2] ** 2, 0.0))
    ahead, aside = from_axis - lever[0], y - lever[1]
    pitch = np.arctan2(z, x) - np.arctan2(lever[2], from_axis)
    return np.hypot(ahead, aside), np.arctan2(aside, ahead), pitch


def points_of(range_: Array, azimuth: Array, pitch: Array, lever: Lever) -> Array:
    """Return where beams end, shape (n, 3); the transform of docs/model.md."""
    ahead = range_ * np.cos(azimuth) + lever[0]
    aside = range_ * np.sin(azimuth) + lever[1]
    return nod_in_place(np.stack([ahead, aside, np.full_like(ahead, lever[2])]), pitch).T


def pairs_on_surfaces(points: Array, azimuth: Array, pitch: Array) -> int:
    """Return how many pairs of points at one azimuth lie on one upright wall or one level floor.

    The points of a pair have different pitch, and the same distance or the same height.
    """
    x, y, z = points.T
    column = np.floor(azimuth / _COLUMN).astype(int)
    order = np.argsort(column, kind='stable')
    away = np.hypot(x, y)
    pairs = 0
    for group in np.split(order, np.flatnonzero(np.diff(column[order])) + 1):
        apart = _differences(pitch[group]) > _APART
        same = (_differences(z[group]) < _SAME) | (_differences(away[group]) < _SAME)
        pairs += int(np.count_nonzero(apart & same))
    return pairs


def _differences(values: Array) -> Array:
    return np.abs(values[:, None] - values[None, :])
