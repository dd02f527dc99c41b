"""How the lidar is mounted, from its own cloud: joint's sign, lever arm, which way is up.

Points are turned back into range, azimuth and pitch of their beams, and placed again as if the
joint's sign, the lever arm or both were reversed. The mount is the one with which the floor is
where the height of the nod axis says. A zero of the joint that is off tilts the floor, and moves
it much as a reversed lever arm does: so each mount is tried with all zeros.

If no floor is seen there, walls and floor still show something. With one of both wrong, the
optical centre moves the wrong way: walls lean and the floor bends. With both wrong (the whole
sensor upside down), the cloud is an exact mirror image.

Which way is left, a cloud of a room at rest cannot show: that is left to the user.
"""

from dataclasses import dataclass, field

from nodlidar_assembler.clouds.points import nod_in_place
from nodlidar_common.arrays import Array
import numpy as np

Lever = tuple[float, float, float]

LEAST_POINTS = 2000
_NEAREST_X = 0.4  # [m]: beams to the sides and back hardly show the lever arm
_FLOOR_BAND = 0.10  # [m]
_LEVEL_BAND = 0.05  # [m]: a floor with the right zero is thinner
_ABOUT_BEST = 0.95  # of the best share
_ZEROS = np.linspace(-0.4, 0.4, 81)  # [rad]
_ROW = 0.02  # [rad]: pitch in which points count together
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
    level
        Pitch of the joint at which beams are level [rad]: that by which the mount is known to be
        tilted.
    """

    lever: Lever
    height: float
    upside_down: bool = False
    level: float = 0.0


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
        Share of the points on the floor, for each mount, if each pitch counts alike.
    leveled
        The same share on a floor that the best zero makes level, for each mount.
    zeros
        That zero of the joint [rad]: the measured pitch of level beams, less the known one.
    leveling
        How many times as many pairs of points lie on one wall or floor with each mount and its
        best zero as with the mount as known.
    sharpness
        How many times as many pairs of points lie on one wall or floor with the lever arm as known
        as with it reversed.
    nearest
        Range [m] of the nearest point in front, and its azimuth on the robot [rad].
    """

    floor: dict[Reversed, float] = field(default_factory=dict)
    leveled: dict[Reversed, float] = field(default_factory=dict)
    zeros: dict[Reversed, float] = field(default_factory=dict)
    leveling: dict[Reversed, float] = field(default_factory=dict)
    sharpness: float = 1.0
    nearest: tuple[float, float] = (0.0, 0.0)


def seen_in(points: Array, mounting: Mounting) -> Seen | None:
    """Return what a cloud in nodlidar_base_link shows, shape (n, 3); None with too few points."""
    points = points[points[:, 0] > _NEAREST_X]
    if len(points) < LEAST_POINTS:
        return None
    range_, azimuth, pitch = beams_of(points, mounting.lever)
    x, y, z = mounting.lever
    weights = _weights(pitch)
    floor, leveled, zeros, pairs, level_pairs = {}, {}, {}, {}, {}
    for each in ALL:
        lever = (x, y, -z if each.lever else z)
        turned = (-pitch if each.joint else pitch) - mounting.level
        height = mounting.height if not mounting.upside_down else -mounting.height
        placed = points_of(range_, azimuth, turned, lever)
        floor[each] = float(weights[np.abs(placed[:, 2] + height) < _FLOOR_BAND].sum())
        leveled[each], zeros[each] = _best_zero(placed, weights, height)
        if not each.joint:
            pairs[each] = pairs_on_surfaces(placed, azimuth, pitch)
        level = nod_in_place(placed.T, np.full(len(placed), -zeros[each])).T
        level_pairs[each] = pairs_on_surfaces(level, azimuth, pitch)
    near, side = int(np.argmin(range_)), -1.0 if mounting.upside_down else 1.0
    return Seen(
        floor,
        leveled,
        zeros,
        {each: count / max(pairs[AS_KNOWN], 1) for each, count in level_pairs.items()},
        pairs[AS_KNOWN] / max(pairs[Reversed(lever=True)], 1),
        (float(range_[near]), side * float(azimuth[near])),
    )


def _weights(pitch: Array) -> Array:
    """Return weights by which each pitch [rad] counts alike, of sum 1.

    A joint that dwells at its limits sees little of a room, but has most points there.
    """
    rows = np.floor((pitch - pitch.min()) / _ROW).astype(int)
    counts = np.bincount(rows)
    return np.asarray(1.0 / (counts[rows] * np.count_nonzero(counts)))


def _best_zero(points: Array, weights: Array, height: float) -> tuple[float, float]:
    """Return the largest share of the points on the floor that a zero makes level, and the zero.

    Parameters
    ----------
    points
        Points, shape (n, 3), as placed with the zero 0.
    weights
        How much each counts, shape (n,).
    height
        Height of the nod axis above the floor [m].
    """
    away, elevation = np.hypot(points[:, 0], points[:, 2]), np.arctan2(points[:, 2], points[:, 0])
    heights = (away * np.sin(elevation - zero) + height for zero in _ZEROS)
    shares = np.array([weights[np.abs(each) < _LEVEL_BAND].sum() for each in heights])
    best = float(shares.max())
    # A thin floor is within the band for several: its middle is the zero.
    middle = float(_ZEROS[shares >= _ABOUT_BEST * best].mean())
    return best, middle


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
