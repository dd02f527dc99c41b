"""The linear system of a calibration: values and planes that bring the ends of beams onto planes.

Each plane has its own excess of the range, as lidars have by brightness and material, and all
share one that grows with the incidence. The encoder has a smooth error over the nod angle, as
potentiometers and gears with play have: a Gaussian process. All are unknowns, with the spread that
devices show.
"""

from dataclasses import dataclass, field, replace

from nodlidar_assembler.calibration.beam_model import (
    Ends,
    ends_of,
    MeasuredBeams,
    moved_by_pitch,
    Values,
)
from nodlidar_assembler.calibration.level import Level
from nodlidar_assembler.calibration.noise import noise_variance
from nodlidar_assembler.calibration.plane_search import Labels, PATCH, patches, Plane
from nodlidar_assembler.calibration.relief import Relief
from nodlidar_assembler.calibration.robust_covariance import inverse_of, spread_of, standard_errors
from nodlidar_common.arrays import Array
import numpy as np

# Standard deviation of each value before any measurement [s], [rad], [m].
BEFORE = {
    'delay': 0.05,
    'zero': 0.2,
    'roll': 0.1,
    'yaw': 0.1,
    'x': 0.03,
    'z': 0.03,
    'elevation': 0.02,
    'offset': 0.03,
}
BIAS = 0.01  # of ranges: Kneip et al., ICRA 2009, and Okubo et al., 2009, found 5 to 20 mm [m]
TILT = 0.2  # of the base about its x axis [rad]
REDESCENDING = 4.0  # standard deviations; Tukey's biweight ignores what is farther off
BEND = 3e-3  # of the smooth error of an encoder, as of usual servos [rad],
BENDS_BEFORE = 0.5  # ... which counts as much as this many errors that the data determine
KNOTS = np.linspace(-1.6, 1.6, 25)  # of nod angle, between which it is linear [rad]
ALIKE = 0.5  # difference of nod angles whose errors are alike: a few waves per turn [rad]
ROUGH = 0.1  # share of an encoder's error that is alike nowhere
MEAN_BEND = 1e-5  # over the beams: the mean belongs to the joint zero [rad]
# Information of the errors at the knots, whose standard deviation is 1.
_SMOOTH = np.exp(-0.5 * ((KNOTS - KNOTS[:, None]) / ALIKE) ** 2)
_OF_KNOTS = np.linalg.inv((1.0 - ROUGH**2) * _SMOOTH + ROUGH**2 * np.eye(len(KNOTS)))
_OF_PLANE = 4  # unknowns: two slopes, offset, excess of the range


@dataclass(frozen=True, slots=True)
class Solution:
    """Values and planes, and how sure they are.

    Attributes
    ----------
    values, planes, tilt, slant, biases, bends
        The unknowns: tilt of the base [rad], excess of the range at grazing incidence [m] and of
        each plane [m], errors of the encoder at the knots [rad].
    bend
        Their standard deviation [rad], learned from them.
    errors
        Standard errors of the named values, shape (k,); None if they were not asked for.
    """

    values: Values
    planes: list[Plane]
    tilt: float = 0.0
    slant: float = 0.0
    biases: Array = field(default_factory=lambda: np.zeros(0))
    bends: Array = field(default_factory=lambda: np.zeros(len(KNOTS)))
    bend: float = BEND
    errors: Array | None = None


@dataclass(frozen=True, slots=True)
class _Rows:
    """Residuals [m], derivatives (n, unknowns), weights, slopes of the influence, and relief."""

    residual: Array
    slopes: Array
    weight: Array
    influence: Array
    relief: Relief


class PlaneSystem:
    """Solves for values and planes from beams on known planes.

    Parameters
    ----------
    beams, labels
        The beams, and the plane of each.
    names, expected
        The values to solve for, and what they are expected at.
    level
        Which way is up; None if that is unknown.
    """

    def __init__(
        self,
        beams: MeasuredBeams,
        labels: Labels,
        names: tuple[str, ...],
        expected: Values,
        level: Level | None,
    ) -> None:
        self._beams, self._labels, self.names, self._level = beams, labels, names, level
        self._expected = expected
        self._bends = slice(len(names), len(names) + len(KNOTS))  # of the unknowns
        self._first = self._bends.stop + 2

    def step(self, before: Solution, with_errors: bool = False) -> Solution:
        """Return the solution after a Gauss-Newton step."""
        ends = ends_of(self._beams, before.values, False)
        bases, k = [_basis(plane.normal) for plane in before.planes], len(self.names)
        hats = _hats(self._beams, before.values)
        rows = self._rows(ends, before, bases, hats)
        level_residual, level_slopes, level_weight = self._level_rows(before, bases)
        deviation, prior = self._prior(before, hats)
        of_others = prior + level_slopes.T @ (level_slopes * level_weight[:, None])
        normal = of_others + rows.relief.normal(rows.slopes, rows.weight)
        pull = rows.weight * rows.relief.without(rows.residual, rows.weight)
        right = rows.slopes.T @ pull + prior @ deviation
        right += level_slopes.T @ (level_weight * level_residual)
        inverse = inverse_of(normal)
        change = -inverse @ right
        errors = None
        if with_errors:
            scores = rows.slopes * pull[:, None]
            level_scores = level_slopes * (level_weight * level_residual)[:, None]
            spread = spread_of(scores, self._beams.scan) + level_scores.T @ level_scores + prior
            errors = standard_errors(_curvature(normal, of_others, rows), spread)[:k]
        after = self._moved(before, bases, change, errors)
        return replace(after, bend=self._learned_bend(after, inverse))

    def _learned_bend(self, after: Solution, covariance: Array) -> float:
        """Return the spread of the encoder's errors [rad].

        MacKay, "Bayesian Interpolation", Neural Computation, 1992. Without a spread expected
        before, it falls to 0 where another lever arm does as well, and that may be wrong by cm.
        """
        own = self._bends
        known = len(KNOTS) - np.sum(_OF_KNOTS * covariance[own, own]) / after.bend**2
        square = BENDS_BEFORE * BEND**2 + after.bends @ _OF_KNOTS @ after.bends
        return float(np.sqrt(square / (BENDS_BEFORE + max(known, 0.0))))

    def _rows(self, ends: Ends, at: Solution, bases: list[Array], hats: Array) -> _Rows:
        """Return the rows; their derivatives are at the planes, where no noise biases them."""
        normals = np.array([plane.normal for plane in at.planes])[self._labels].T
        offsets = np.array([plane.offset for plane in at.planes])[self._labels]
        cosine = np.sum(normals * ends.ways, axis=0)
        grazing = 1.0 - np.abs(cosine)
        excess = at.biases[self._labels] + at.slant * grazing
        place = ends.xyz - ends.ways * excess + moved_by_pitch(ends.xyz) * (at.bends @ hats)
        residual = np.sum(normals * place, axis=0) - offsets
        true = replace(self._beams, ranges=self._beams.ranges - excess - residual / cosine)
        variance = noise_variance(residual, cosine, true.ranges)
        far = np.clip(residual / np.sqrt(variance) / REDESCENDING, -1.0, 1.0) ** 2
        weight = (1.0 - far) ** 2 / variance
        influence = (1.0 - far) * (1.0 - 5.0 * far) / variance
        # By where the beams cross their planes: else the noise would choose the patches.
        relief = Relief.of(
            residual, weight, self._patches(place - ends.ways * (residual / cosine))
        )
        tangents = np.array(bases)[self._labels]
        on_plane = ends_of(true, at.values)
        shared = [
            *(np.sum(normals * on_plane.moves[name], axis=0) for name in self.names),
            *(hats * np.sum(normals * moved_by_pitch(on_plane.xyz), axis=0)),
            -cosine * grazing,
            np.zeros(len(residual)),
        ]
        of_plane = [
            np.einsum('nk,kn->n', tangents[:, 0], on_plane.xyz),
            np.einsum('nk,kn->n', tangents[:, 1], on_plane.xyz),
            -np.ones(len(residual)),
            -cosine,
        ]
        weight, influence = weight * relief.counts, influence * relief.counts
        slopes = self._slopes(shared, of_plane, len(at.planes))
        return _Rows(residual, slopes, weight, influence, relief)

    def _patches(self, xyz: Array) -> Labels:
        """Return the patch of its plane in which each beam ends [m], (3, n); shape (n,)."""
        own = patches(xyz, PATCH) * (int(self._labels.max()) + 1) + self._labels
        return np.asarray(np.unique(own, return_inverse=True)[1])

    def _slopes(self, shared: list[Array], of_plane: list[Array], planes: int) -> Array:
        """Return the derivatives by what all share and by each row's plane, (n, unknowns)."""
        slopes = np.zeros((len(self._labels), self._first + _OF_PLANE * planes))
        slopes[:, : self._first] = np.stack(shared, axis=1)
        own = self._first + _OF_PLANE * self._labels[:, None] + np.arange(_OF_PLANE)
        np.put_along_axis(slopes, own, np.stack(of_plane, axis=1), axis=1)
        return slopes

    def _level_rows(self, at: Solution, bases: list[Array]) -> tuple[Array, Array, Array]:
        """Return residuals [rad], derivatives and weights of what is level or upright."""
        residuals, slopes, size = [], [], self._first + _OF_PLANE * len(at.planes)
        if self._level is None:
            return np.zeros(0), np.zeros((0, size)), np.zeros(0)
        for number, (plane, basis) in enumerate(zip(at.planes, bases, strict=True)):
            first = self._first + _OF_PLANE * number
            for residual, by_tilt, target in self._level.residuals(plane.normal, at.tilt):
                row = np.zeros(size)
                row[first : first + 2] = basis @ target
                row[self._first - 1] = by_tilt
                residuals.append(residual)
                slopes.append(row)
        values = np.array(residuals)
        return values, np.reshape(slopes, (len(values), size)), self._level.weight(values)

    def _prior(self, at: Solution, hats: Array) -> tuple[Array, Array]:
        """Return each unknown minus its prior mean, where that is known, and the information."""
        planes = len(at.planes)
        deviation = np.zeros(self._first + _OF_PLANE * planes)
        # That of slopes and offsets keeps a plane without weight in place.
        spread = np.ones(len(deviation))
        for column, name in enumerate(self.names):
            deviation[column] = getattr(at.values, name) - getattr(self._expected, name)
        spread[: self._bends.start] = [BEFORE[name] for name in self.names]
        spread[self._bends.stop : self._first] = BIAS, TILT
        deviation[self._bends] = at.bends
        deviation[self._bends.stop : self._first] = at.slant, at.tilt
        spread[self._first + 3 :: _OF_PLANE] = BIAS
        deviation[self._first + 3 :: _OF_PLANE] = at.biases
        information = np.diag(spread**-2.0)
        share = hats.mean(axis=1)
        information[self._bends, self._bends] = (
            _OF_KNOTS / at.bend**2 + np.outer(share, share) / MEAN_BEND**2
        )
        return deviation, information

    def _moved(
        self, before: Solution, bases: list[Array], change: Array, errors: Array | None
    ) -> Solution:
        """Return a solution with its unknowns changed."""
        own = change[self._first :].reshape(-1, _OF_PLANE)
        planes = []
        for plane, basis, (one, two, offset, _) in zip(before.planes, bases, own, strict=True):
            normal = plane.normal + one * basis[0] + two * basis[1]
            length = np.linalg.norm(normal)
            planes.append(Plane(normal / length, float((plane.offset + offset) / length)))
        slant, tilt = change[self._bends.stop : self._first]
        return Solution(
            before.values.moved(self.names, change[: len(self.names)]),
            planes,
            before.tilt + float(tilt),
            before.slant + float(slant),
            before.biases + own[:, 3],
            before.bends + change[self._bends],
            before.bend,
            errors,
        )


def bent_ends(beams: MeasuredBeams, solution: Solution) -> Ends:
    """Return where beams end, with the smooth error of the encoder of a solution."""
    ends = ends_of(beams, solution.values, False)
    bent = moved_by_pitch(ends.xyz) * (solution.bends @ _hats(beams, solution.values))
    return replace(ends, xyz=ends.xyz + bent)


def _hats(beams: MeasuredBeams, values: Values) -> Array:
    """Return the share of each knot in each beam, shape (knots, n)."""
    position, _ = beams.track.at(beams.time + values.delay)
    apart = np.abs(position - values.zero - KNOTS[:, None]) / (KNOTS[1] - KNOTS[0])
    return np.asarray(np.maximum(1.0 - apart, 0.0))


def _basis(normal: Array) -> Array:
    """Return two unit vectors across a normal, shape (2, 3)."""
    return np.asarray(np.linalg.svd(normal[None, :])[2][1:])


def _curvature(normal: Array, of_others: Array, rows: _Rows) -> Array:
    """Return the normal matrix, with the curvature that the shape of the beams' weights has.

    `of_others` is what the normal matrix has beside the beams. Where most of these are outliers,
    there may be no minimum; then it is the normal matrix.
    """
    curvature = of_others + rows.relief.normal(rows.slopes, rows.influence)
    return curvature if np.linalg.eigvalsh(curvature)[0] > 0.0 else normal
