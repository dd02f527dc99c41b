"""The planes of a scene, found in the ends of beams that may still be several cm off."""

from dataclasses import dataclass
import math

from nodlidar_assembler.calibration.beam_model import Ends
from nodlidar_common.arrays import Array, Integers, Mask
import numpy as np

Labels = Integers

CELL = 0.3  # edge of the cubes in which a surface is taken for flat [m]
EDGE = 0.05  # beams that end this much closer than the gate to another plane do not count [m],
PARALLEL = 0.9  # ... unless this is the cosine of the angle between the two, or more
GRAZING = 0.15  # cosine of incidence below which a beam does not count
PATCH = 0.2  # edge of the cubes in which a surface is all of a plane, or is not [m]
SURE = 2.0  # standard deviations of a mean by the noise of its beams, which add to a gate
LEAST_SHARE = 0.9  # of the beams towards a patch that end there; else objects stand before it
MOST_PLANES = 24
LEAST_WIDTH = 0.2  # standard deviation of its cubes across the shorter side of a plane [m]
LEAST_POINTS = 0.01  # share of all points
_LEAST_IN_CELL = 6
_LEAST_SPREAD = 0.03  # along a surface in its cube [m]
_REACHES = (0.8, 1.6, 3.2, math.inf, math.inf)  # around the seed, from which a plane grows [m]


@dataclass(frozen=True, slots=True)
class Cells:
    """Cubes with points, and the moments of these.

    Attributes
    ----------
    count, mean, scatter
        Number, mean [m] and mean products of the points' offsets from it [m^2], shapes (c,),
        (c, 3), (c, 3, 3).
    variance, axes
        Eigenvalues [m^2], ascending, (c, 3), and eigenvectors in columns, (c, 3, 3).
    """

    count: Array
    mean: Array
    scatter: Array
    variance: Array
    axes: Array

    @classmethod
    def of(cls, xyz: Array, size: float = CELL) -> 'Cells':
        """Return the cubes of points (3, n)."""
        of_point = patches(xyz, size)
        count = np.bincount(of_point).astype(np.float64)
        mean = np.stack([np.bincount(of_point, row) / count for row in xyz], axis=1)
        off = xyz - mean[of_point].T
        scatter = np.empty((len(count), 3, 3))
        for i in range(3):
            for j in range(i + 1):
                scatter[:, i, j] = np.bincount(of_point, off[i] * off[j]) / count
                scatter[:, j, i] = scatter[:, i, j]
        return cls(count, mean, scatter, *np.linalg.eigh(scatter))

    def thickness(self, limit: float) -> float:
        """Return the RMS thickness [m] over all points, in each cube up to a limit [m]."""
        used = self.count >= _LEAST_IN_CELL
        if not used.any():
            return limit
        variance = np.clip(self.variance[used, 0], 0.0, limit**2)
        return math.sqrt(float(np.average(variance, weights=self.count[used])))


def patches(xyz: Array, size: float) -> Labels:
    """Return the number, from 0, of the cube of each point (3, n), given the edge of cubes [m]."""
    index = np.floor(xyz / size).astype(np.int64) + (1 << 20)
    cube = (index[0] << 42) + (index[1] << 21) + index[2]
    return np.asarray(np.unique(cube, return_inverse=True)[1])


@dataclass(frozen=True, slots=True)
class Plane:
    """The points x with ``normal . x = offset`` [m]."""

    normal: Array
    offset: float


@dataclass(frozen=True, slots=True)
class Gate:
    """How far from its plane something may be.

    Attributes
    ----------
    beam, patch
        Distance of a beam's end, and of the mean of a patch or cube [m]. Less for the latter tells
        a door from its wall, which noise does not allow for single beams.
    angle
        Of a cube [rad].
    """

    beam: float
    patch: float
    angle: float


def find_planes(ranges: Array, ends: Ends, gate: Gate) -> tuple[list[Plane], Labels]:
    """Return the large planes, and that of each beam, -1 for none, shape (n,).

    Planes grow from the cube with the most points over cubes that are flat and lie in them.

    Parameters
    ----------
    ranges, ends
        Of the beams, shape (n,).
    gate
        How far off its plane what belongs to it may be.
    """
    cells = Cells.of(ends.xyz)
    wide = np.sqrt(np.maximum(cells.variance[:, 1], 0.0)) > _LEAST_SPREAD
    thin = cells.variance[:, 0] < gate.beam**2
    free = wide & thin & (cells.count >= _LEAST_IN_CELL)
    planes: list[Plane] = []
    seeds = np.argsort(-cells.count)
    for seed in seeds[free[seeds]]:
        if not free[seed] or len(planes) == MOST_PLANES:
            continue
        members = _grown(cells, int(seed), free, gate)
        free[seed] = False
        if members is None or cells.count[members].sum() < LEAST_POINTS * len(ranges):
            continue
        if _width(cells, members) >= LEAST_WIDTH:
            free[members] = False
            planes.append(_fit(cells, members))
    planes = _distinct(_moved(planes, _labels(ranges, ends, planes, gate), ends), gate)
    return _kept(planes, _labels(ranges, ends, planes, gate))


def _moved(planes: list[Plane], labels: Labels, ends: Ends) -> list[Plane]:
    """Return the planes, moved to the mean of their beams.

    Where a surface lies in the side of its cubes, each side of it has a plane of its own, some mm
    off.
    """
    moved = []
    for number, plane in enumerate(planes):
        own = ends.xyz[:, labels == number]
        offset = float(plane.normal @ own.mean(axis=1)) if own.size else plane.offset
        moved.append(Plane(plane.normal, offset))
    return moved


def _distinct(planes: list[Plane], gate: Gate) -> list[Plane]:
    """Return the planes without those that hardly differ from an earlier one."""
    distinct: list[Plane] = []
    for plane in planes:
        cosines = np.array([plane.normal @ each.normal for each in distinct])
        offsets = np.sign(cosines) * [each.offset for each in distinct]
        near = np.abs(plane.offset - offsets) < gate.patch / 2.0
        if not np.any(near & (np.abs(cosines) > PARALLEL)):
            distinct.append(plane)
    return distinct


def _kept(planes: list[Plane], labels: Labels) -> tuple[list[Plane], Labels]:
    """Return the planes with enough points, and the labels of these."""
    count = np.bincount(labels + 1, minlength=len(planes) + 1)
    kept = np.flatnonzero(count[1:] >= LEAST_POINTS * len(labels) / 2.0)
    renamed = np.full(len(planes) + 1, -1)
    renamed[kept + 1] = np.arange(len(kept))
    return [planes[k] for k in kept], renamed[labels + 1]


def _grown(cells: Cells, seed: int, free: Mask, gate: Gate) -> Labels | None:
    """Return the cubes of the plane that grows from a seed; None if it shrinks to nothing."""
    center = cells.mean[seed]
    plane = Plane(cells.axes[seed, :, 0], float(cells.axes[seed, :, 0] @ center))
    away = np.linalg.norm(cells.mean - center, axis=1)
    members: Labels | None = None
    noise = SURE * np.sqrt(np.maximum(cells.variance[:, 0], 0.0) / cells.count)
    for reach in _REACHES:
        parallel = np.abs(cells.axes[:, :, 0] @ plane.normal) > math.cos(gate.angle)
        within = np.abs(cells.mean @ plane.normal - plane.offset) < gate.patch + noise
        members = np.flatnonzero(free & parallel & within & (away < reach))
        if not len(members):
            return None
        plane = _fit(cells, members)
    return members


def _fit(cells: Cells, members: Labels) -> Plane:
    """Return the plane of the points in cubes."""
    mean, scatter = _moments(cells, members, cells.count[members])
    normal = np.linalg.eigh(scatter)[1][:, 0]
    return Plane(normal, float(normal @ mean))


def _width(cells: Cells, members: Labels) -> float:
    """Return the spread [m] across the shorter side of a plane, if all its cubes count alike.

    Beams are dense beside the nod axis: by them, a wall there would be narrow, however large.
    """
    _, scatter = _moments(cells, members, np.ones(len(members)))
    return math.sqrt(max(float(np.linalg.eigvalsh(scatter)[1]), 0.0))


def _moments(cells: Cells, members: Labels, weights: Array) -> tuple[Array, Array]:
    """Return the mean [m] and the mean products of offsets from it [m^2] of weighted cubes."""
    mean = np.average(cells.mean[members], axis=0, weights=weights)
    off = cells.mean[members] - mean
    outer = cells.scatter[members] + off[:, :, None] * off[:, None, :]
    return mean, np.average(outer, axis=0, weights=weights)


def _labels(ranges: Array, ends: Ends, planes: list[Plane], gate: Gate) -> Labels:
    """Return the plane on which each beam ends, -1 for none.

    Beams are chosen by where they cross a plane, not by where they were measured: else those near
    an edge would be chosen by their noise, which brought x 5 mm off.
    """
    labels = np.full(len(ranges), -1)
    for number, plane in enumerate(planes):
        along = plane.normal @ ends.ways
        off = plane.normal @ ends.xyz - plane.offset
        with np.errstate(divide='ignore'):
            beyond = off / along
        met = np.flatnonzero((np.abs(along) > GRAZING) & (beyond < ranges))
        crossing = ends.xyz[:, met] - ends.ways[:, met] * beyond[met]
        close = np.abs(off[met]) < gate.beam
        if not close.any():
            continue
        patch = patches(crossing, PATCH)
        here = np.bincount(patch, close)
        share = here / np.bincount(patch)
        mean = np.bincount(patch, close * off[met]) / np.maximum(here, 1.0)
        noise = SURE * np.std(off[met[close]]) / np.sqrt(np.maximum(here, 1.0))
        whole = (share > LEAST_SHARE) & (np.abs(mean) < gate.patch + noise)
        others = [each for each in planes if abs(each.normal @ plane.normal) < PARALLEL]
        clear = [
            np.abs(each.normal @ crossing - each.offset) > gate.beam + EDGE for each in others
        ]
        labels[met[close & whole[patch] & np.all(clear, axis=0)]] = number
    return labels
