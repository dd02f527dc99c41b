"""Where in a map a cloud was taken, without a good guess."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor, pi
from typing import Any

from nodlidar_common.arrays import Array, Mask
from nodlidar_mapper.geometry.poses import between, inverse, moved, planar
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe, surface_of_map
from nodlidar_mapper.recovery.range_image import RangeImage
from nodlidar_mapper.tracking.matching import Match, match, MatchingConfig
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

# Places are searched on a grid, by the cubes that the map fills.
CUBE = 0.25  # m
TURN = 0.06  # rad
FILLED = 2  # what a point in such a cube counts, and beside one half of it
SPACING = 0.5  # of the points that are searched with [m]
OFF = 2.0  # the robot is at most this far off the keyframes, along x and y [m]
APART = 0.75, 0.3  # candidates differ by more than this [m], [rad]
CANDIDATES = 6
ALIKE = 0.94  # a place with at least this share of the fit of another one fits alike
START = np.diag([0.3**-2] * 3 + [0.1**-2] * 3)  # information of a candidate

THROUGH = 0.3  # a beam that ends this much farther went through [m]
NEAREST = 4  # keyframes that judge a place
LEAST_JUDGED = 30  # points


@dataclass(frozen=True, slots=True)
class Area:
    """Where to search: within a distance [m] and a turn [rad] of a pose."""

    pose: Array
    distance: float
    turn: float


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A place where a cloud may have been taken.

    Attributes
    ----------
    found
        The cloud matched there.
    fit
        Share of all points that lie on the map.
    clear
        Share of the points that no keyframe sees through.
    rival
        Fit of the best other place.
    """

    found: Match
    fit: float
    clear: float
    rival: float


def best_place(
    seen: Seen, keyframes: Sequence[Keyframe], area: Area, config: MatchingConfig
) -> Place | None:
    """Return the best place in an area; None if the map or the cloud is empty.

    Of places that fit alike, it is the one nearest to the pose of the area: along a corridor, all
    places may be alike.

    Parameters
    ----------
    seen
        The cloud, in its frame.
    keyframes
        Of the map.
    area
        Where to search.
    config
        Of the matching.
    """
    surface = surface_of_map(keyframes)
    if not len(surface.points) or not len(seen.points):
        return None
    known = np.stack([keyframe.pose[:3, 3] for keyframe in keyframes])
    candidates = [area.pose, *_candidates(seen, surface, area, known)]
    places = [match(seen, surface, at, START, config, 2.0 * config.reach) for at in candidates]
    highest = max(map(fit_of, places))
    alike = [each for each in places if fit_of(each) >= ALIKE * highest]
    best = min(alike, key=lambda each: between(each.pose, area.pose)[0])
    others = [fit_of(each) for each in places if _differ(each.pose, best.pose)]
    clear = clear_share(seen.points, best.pose, keyframes, best.on)
    return Place(best, fit_of(best), clear, max(others, default=0.0))


def fit_of(found: Match) -> float:
    """Return the share of all points that lie on the map."""
    return found.share * found.near_share


def clear_share(
    points: Array,
    pose: Array,
    keyframes: Sequence[Keyframe],
    on: Mask | None = None,
) -> float:
    """Return the share of points that the nearest keyframes do not see through.

    At a wrong place, walls stand where others have seen that there is nothing. A beam that ends
    far beyond a point on a mapped surface, as far along a floor, went over it.

    Parameters
    ----------
    points
        Of a cloud, in its frame [m], shape (n, 3).
    pose
        Of its frame in the map.
    keyframes
        Of the map.
    on
        Which of the points lie on a surface of the map, shape (n,).
    """
    places = np.stack([keyframe.pose[:3, 3] for keyframe in keyframes])
    near = np.argsort(np.linalg.norm(places - pose[:3, 3], axis=1))[:NEAREST]
    beyond = np.concatenate(
        [
            _image(keyframes[i]).beyond(moved(inverse(keyframes[i].pose) @ pose, points))
            for i in near
        ]
    )
    judged = np.isfinite(beyond) & (beyond > -THROUGH)
    if np.count_nonzero(judged) < LEAST_JUDGED:
        return 1.0
    clear = beyond < THROUGH
    if on is not None:
        clear |= np.tile(on, len(near))
    return float(np.mean(clear[judged]))


@lru_cache(2 * NEAREST)
def _image(keyframe: Keyframe) -> RangeImage:
    """Return what a keyframe sees; clouds are near the same ones for a while."""
    return RangeImage(keyframe.cloud.points)


def _differ(one: Array, other: Array) -> bool:
    distance, turn = between(one, other)
    return distance > APART[0] / 2.0 or turn > APART[1] / 2.0


def _candidates(seen: Seen, surface: Surface, area: Area, known: Array) -> Iterator[Array]:
    """Yield the best poses of the grid near known places (n, 3), each apart from the others."""
    few = seen.thinned(SPACING).points @ area.pose[:3, :3].T
    along_x, along_y = (_steps(area.pose[k, 3], area.distance, known[:, k]) for k in (0, 1))
    count = ceil(min(area.turn, pi) / TURN)
    turns = np.arange(-count, count + 1) * TURN
    if not len(along_x) or not len(along_y):
        return
    reach = np.linalg.norm(few[:, :2], axis=1).max()
    first = (area.pose[:2, 3] - reach) / CUBE + (along_x[0], along_y[0])
    last = (area.pose[:2, 3] + reach) / CUBE + (along_x[-1], along_y[-1])
    filled, corner = _filled(surface.points, np.floor(first), np.floor(last))
    scores = np.zeros(
        (len(turns), len(along_x), len(along_y)), dtype=np.min_scalar_type(FILLED * len(few))
    )
    for turn, score in zip(turns, scores, strict=True):
        points = moved(planar(0.0, 0.0, turn), few) + area.pose[:3, 3]
        _add_scores(score, points, filled, corner - (along_x[0], along_y[0], 0))
    for _ in range(CANDIDATES):
        best = np.unravel_index(int(np.argmax(scores)), scores.shape)
        turn, x, y = turns[best[0]], along_x[best[1]] * CUBE, along_y[best[2]] * CUBE
        pose = planar(x, y, 0.0) @ area.pose
        pose[:3, :3] = planar(0.0, 0.0, turn)[:3, :3] @ area.pose[:3, :3]
        yield pose
        off = np.abs(turns - turn)
        near_turn = np.minimum(off, 2.0 * pi - off) <= APART[1]
        near_x = np.abs(along_x * CUBE - x) <= APART[0]
        near_y = np.abs(along_y * CUBE - y) <= APART[0]
        scores[np.ix_(near_turn, near_x, near_y)] = 0


def _steps(at: float, distance: float, known: Array) -> NDArray[np.intp]:
    """Return the steps along an axis from a place, within a distance and near known places."""
    low = max(-distance, float(known.min()) - OFF - at)
    high = min(distance, float(known.max()) + OFF - at)
    return np.arange(ceil(low / CUBE), floor(high / CUBE) + 1)


def _filled(
    points: Array, first: Array, last: Array
) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """Return how much of the map each cube (z, x, y) has: FILLED, beside one 1; and the corner.

    There is room for the cubes from first to last, shape (2,) each, so that none is beside it.
    """
    corner = np.floor(points.min(axis=0) / CUBE).astype(np.intp) - 2
    cubes = np.floor(points / CUBE).astype(np.intp) - corner
    filled = np.zeros(cubes.max(axis=0) + 3, dtype=np.bool_)
    filled[tuple(cubes.T)] = True
    shares = np.add(filled, binary_dilation(filled), dtype=np.uint8)
    before = np.maximum(corner[:2] - first, 0.0).astype(np.intp)
    behind = np.maximum(last - corner[:2] - filled.shape[:2] + 1.0, 0.0).astype(np.intp)
    room = (0, 0), (before[0], behind[0]), (before[1], behind[1])
    return np.pad(np.moveaxis(shares, 2, 0), room), corner - (*before, 0)


def _add_scores(
    scores: NDArray[Any], points: Array, filled: NDArray[np.uint8], corner: NDArray[np.intp]
) -> None:
    """Add how much of the map points (n, 3) have to scores (x, y), of each step along x and y."""
    steps_x, steps_y = scores.shape
    cubes = np.floor(points / CUBE).astype(np.intp) - corner
    inside = (cubes[:, 2] >= 0) & (cubes[:, 2] < len(filled))
    for x, y, z in cubes[inside].tolist():
        scores += filled[z, x : x + steps_x, y : y + steps_y]
