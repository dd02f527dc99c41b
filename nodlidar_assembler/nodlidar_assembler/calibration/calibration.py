"""Calibrates a nodding lidar from a static scene, by what must be flat.

Upward and downward sweeps see the same surfaces, so that a delay shows; planes that beams of many
azimuths and nod angles see must be flat, so that the mounting of the lidar shows. See
docs/calibration.md for what a scene determines.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from nodlidar_assembler.calibration.beam_model import (
    CalibrationError,
    ends_of,
    MeasuredBeams,
    Values,
)
from nodlidar_assembler.calibration.level import Level
from nodlidar_assembler.calibration.plane_search import Cells, find_planes, Gate
from nodlidar_assembler.calibration.plane_system import bent_ends, PlaneSystem, Solution
from nodlidar_common.arrays import Array, Mask
import numpy as np

NAMES = ('delay', 'zero', 'roll', 'yaw', 'x', 'z')
OPTIONAL = ('elevation', 'offset')  # if asked for: they make the others less certain
# Largest standard error with which a value counts as determined [s], [rad], [m]. For x, z and the
# offset, a ruler is as good, and an x or z that is stated with more may be 30 mm off.
DETERMINED = {
    'delay': 2e-3,
    'zero': math.radians(0.5),
    'roll': math.radians(0.5),
    'yaw': math.radians(0.5),
    'x': 0.006,
    'z': 0.006,
    'elevation': math.radians(0.2),
    'offset': 0.01,
}
UNITS = {'delay': 's', 'x': 'm', 'z': 'm', 'offset': 'm'}  # of values that are no angles
# How far from coarse to fine a beam [m], a patch [m] and its angle [rad] may be off their plane.
GATES = (
    Gate(0.15, 0.15, 0.5),
    Gate(0.12, 0.12, 0.3),
    Gate(0.09, 0.06, 0.2),
    Gate(0.07, 0.02, 0.2),
    Gate(0.07, 0.006, 0.2),
    Gate(0.07, 0.006, 0.2),
)
STEPS = 4  # of Gauss and Newton at each gate
DELAYS = np.arange(-0.06, 0.0601, 0.004)  # tried first [s]
_THICKEST = 0.1  # of a surface in a cube, while the delay is unknown [m]
_LARGEST_DELAY = 0.1  # off that before [s]
_LEAST_BEAMS = 2000


@dataclass(frozen=True, slots=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    start, values
        The values before and after; what is not determined is as before.
    errors
        Standard errors of the named values [s], [rad], [m].
    undetermined
        Why the others are not determined, by their names.
    before, after
        RMS thickness of the planes [m].
    planes
        Their number.
    """

    start: Values
    values: Values
    errors: dict[str, float]
    undetermined: dict[str, str]
    before: float
    after: float
    planes: int


def calibrate(
    beams: MeasuredBeams, start: Values, up: Array | None, wanted: Sequence[str] = NAMES
) -> Calibration:
    """Return the calibration of a static recording.

    Parameters
    ----------
    beams
        Of the recording.
    start
        The values so far.
    up
        Upward in nodlidar_base_link, shape (3,), if floors are level and walls upright; else None.
    wanted
        NAMES, and any of OPTIONAL.

    Raises
    ------
    CalibrationError
        If there are too few beams, or no planes.
    """
    measured, beams = len(beams), beams[_within_joint_states(beams, start)]
    if len(beams) < _LEAST_BEAMS:
        raise CalibrationError(
            f'only {len(beams)} of {measured} ranges were measured between joint states that are '
            f'close enough in time; {_LEAST_BEAMS} are needed'
        )
    level = _level(up)
    names = tuple(name for name in wanted if name != 'zero' or level is not None)
    undetermined: dict[str, str] = {}
    if 'zero' not in names:
        undetermined['zero'] = 'a turn of the whole cloud: without a level floor nothing shows it'
    coarse = replace(start, delay=start.delay + coarse_delay(beams, start))
    solution, system = _solve(beams, coarse, start, names, level)
    assert solution.errors is not None
    errors = dict(zip(names, solution.errors.tolist(), strict=True))
    open_ = [name for name in names if errors[name] > DETERMINED[name]]
    for name in open_:
        error = f'{errors.pop(name):.2g} {UNITS.get(name, "rad")}'
        undetermined[name] = f'this scene leaves it open: standard error {error}'
    if not errors:
        raise CalibrationError('this scene leaves every value open')
    if open_:
        # The others are those that fit what is left as before. Their errors stay: those with the
        # open values known would be too small.
        coarse = replace(solution.values, **{name: getattr(start, name) for name in open_})
        solution, system = _solve(beams, coarse, start, tuple(errors), level)
    before = system.thickness(start)
    after = system.thickness(solution.values)
    return Calibration(
        start, solution.values, errors, undetermined, before, after, len(solution.planes)
    )


def _within_joint_states(beams: MeasuredBeams, start: Values) -> Mask:
    """Return whether the pitch of each beam is known, with any delay that may come out."""
    known = np.ones(len(beams), dtype=np.bool_)
    for other in (-_LARGEST_DELAY, 0.0, _LARGEST_DELAY):
        known &= np.isfinite(beams.track.at(beams.time + start.delay + other)[0])
    return known


def _level(up: Array | None) -> Level | None:
    if up is None or abs(up[1]) > 0.9:  # the nod axis is upright: its zero is a heading
        return None
    return Level(up)


def coarse_delay(beams: MeasuredBeams, start: Values) -> float:
    """Return the delay [s] with which surfaces are thinnest, up and down sweeps together."""
    costs = []
    for delay in DELAYS:
        ends = ends_of(beams, replace(start, delay=start.delay + delay), False).xyz
        costs.append(Cells.of(ends[:, np.isfinite(ends[0])]).thickness(_THICKEST))
    return float(DELAYS[int(np.argmin(costs))])


def _solve(
    beams: MeasuredBeams,
    coarse: Values,
    start: Values,
    names: tuple[str, ...],
    level: Level | None,
) -> tuple[Solution, '_System']:
    """Return the solution from coarse to fine, with its standard errors."""
    solution = Solution(coarse, [])
    for gate in GATES:
        system = _System(beams, (solution, start), names, level, gate)
        solution = system.start
        for _ in range(STEPS):
            solution = system.system.step(solution)
            if abs(solution.values.delay - start.delay) > _LARGEST_DELAY:
                raise CalibrationError('upward and downward sweeps do not fit: what moves?')
        if level is not None:
            level = level.narrower()
    return system.system.step(solution, with_errors=True), system


class _System:
    """The planes that are found with a solution so far, and their system."""

    def __init__(
        self,
        beams: MeasuredBeams,
        before_and_expected: tuple[Solution, Values],
        names: tuple[str, ...],
        level: Level | None,
        gate: Gate,
    ) -> None:
        before, expected = before_and_expected
        beams = beams[np.isfinite(ends_of(beams, before.values, False).xyz[0])]
        planes, labels = find_planes(beams.ranges, bent_ends(beams, before), gate)
        if not planes:
            raise CalibrationError('the scene shows no planes')
        self._beams, self._labels = beams[labels >= 0], labels[labels >= 0]
        self.system = PlaneSystem(self._beams, self._labels, names, expected, level)
        self.start = replace(before, planes=planes, biases=np.zeros(len(planes)))

    def thickness(self, values: Values) -> float:
        """Return the RMS distance [m] of the ends from planes fitted to them, given values."""
        xyz = ends_of(self._beams, values, False).xyz
        squares = 0.0
        for label in np.unique(self._labels):
            own = xyz[:, (self._labels == label) & np.isfinite(xyz[0])]
            squares += len(own.T) * float(np.linalg.eigvalsh(np.cov(own, bias=True))[0])
        return math.sqrt(squares / len(self._labels))
