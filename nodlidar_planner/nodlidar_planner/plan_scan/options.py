"""The command line of plan_scan, whose options are the fields of two dataclasses."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
import os
from pathlib import Path
from typing import Any

from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, parameter
from nodlidar_common.rounding import rounded_down
from nodlidar_planner.choice.front import PATIENCE
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.error_budget.parameters import ErrorParameters, SERVO_ERRORS
from nodlidar_planner.pattern.band import USEFUL_SWEEP
from nodlidar_planner.pattern.nod_speeds import (
    MAX_ACCELERATION,
    MAX_SPEED,
    MAX_SPEEDS,
    shortest_by_mean_speed,
    TIMING_ERROR,
)
from nodlidar_planner.pattern.pattern import MAX_SAMPLES_PER_SWEEP
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.option_fields import add_option, flag

PICTURES = ('.png', '.pdf', '.svg')
_OBJECTIVE = 'completion, revisit, hole, or weights such as completion=1,revisit=0.5,hole=10'
_DESCRIPTION = (
    'Chooses the samples per sweep (N_s), and so the speed of the nod, with which a nodding lidar '
    'finds an object soonest or leaves the smallest hole between its beams. Angles are in radians '
    'unless another unit is stated; positive pitch is up.'
)


@dataclass(frozen=True, slots=True)
class Request:
    """A request about a task; see each field's description.

    Raises
    ------
    ParameterError
        If a value is out of its range, or contradicts another one.
    """

    servo: str = parameter(
        'RX-24F',
        f'Servo whose fastest nod is planned for: {", ".join(MAX_SPEEDS)}',
        choices=tuple(MAX_SPEEDS),
    )
    speed_min: float | None = parameter(
        None,
        'Slowest nod [default: a sweep takes 0.78 s, or half as fast as a slower servo]',
        unit='rad/s',
        minimum=1e-6,
    )
    speed_max: float | None = parameter(
        None,
        f'Fastest nod [default: that of the servo, {MAX_SPEED:g} for an RX-24F, or less if '
        f'reversals at {MAX_ACCELERATION:g} rad/s^2 take longer]',
        unit='rad/s',
        minimum=1e-6,
    )
    start_pitch: float | None = parameter(
        None,
        'Pitch at step 0 of the first revolution, going up [default: half a sample past the lower '
        'limit, for the finest grid]',
        unit='rad',
        minimum=-1.6,
        maximum=1.6,
    )
    objective: str = parameter(
        'completion',
        f'What to minimise: {_OBJECTIVE} (per second of completion and of longest revisit, per '
        'rad of the largest hole); hole_after=8 among them sets the time of the hole [s]',
    )
    time_budget: float | None = parameter(
        None,
        'Choose the smallest hole after this time, and show the front of time and hole',
        unit='s',
        minimum=1e-6,
        maximum=PATIENCE,
    )
    max_hole: float | None = parameter(
        None,
        'Reach this largest hole as soon as possible, and show the front; with --time-budget, '
        'within that time',
        unit='deg',
        minimum=1e-6,
        maximum=180.0,
    )
    timing_error: float | None = parameter(
        None,
        'Standard deviation of the instants at which the servo reverses [default: '
        f'{TIMING_ERROR:g} where completion alone counts, else 0]',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    samples_per_sweep: int | None = parameter(
        None,
        'Evaluate this N_s at any speed instead of choosing one',
        minimum=1,
        maximum=MAX_SAMPLES_PER_SWEEP,
    )
    error_budget: bool = parameter(
        False, 'Also state the expected error of a point by its sources; --plot draws it'
    )
    json: bool = parameter(False, 'Print one JSON object, with null for infinite values')
    plot: str | None = parameter(None, 'Draw into this .png, .pdf or .svg file')
    top: int | None = parameter(
        None,
        'List this many plans (with a timing error, at most as many as are simulated) [default: '
        '10; 1 with --json]',
        minimum=1,
        maximum=10_000,
    )

    def __post_init__(self) -> None:
        check(self)
        objective_of(self.objective)
        slowest, fastest = self.speed_min, self.speed_max
        if slowest is not None and fastest is not None and fastest < slowest:
            raise ParameterError('speed_max', f'at least --speed-min = {slowest} rad/s', fastest)
        if self.on_the_front:
            self._check_alone()
        if self.plot is not None:
            _check_picture(Path(self.plot))

    @property
    def error(self) -> float:
        """The timing error to plan for [s]."""
        if self.timing_error is not None:
            return self.timing_error
        alone = not self.on_the_front and objective_of(self.objective).only_completion
        return TIMING_ERROR if alone else 0.0

    def fastest(self, task: Task) -> float:
        """Return the highest speed for a task [rad/s]; raises ParameterError if it is too low."""
        if self.speed_max is not None:
            return self.speed_max
        fastest = task.span / shortest_by_mean_speed(task.span, MAX_SPEEDS[self.servo])
        if self.speed_min is not None and self.speed_min > fastest:
            own = f'{rounded_down(fastest)} rad/s, that of the servo'
            limit = f'at most {own}, or speed_max given as well'
            raise ParameterError('speed_min', limit, self.speed_min)
        return fastest

    def slowest(self, task: Task) -> float | None:
        """Return the lowest speed for a task [rad/s]; None for that of sweeps of 0.78 s.

        For a servo that is slower than that, it is half of its highest.
        """
        if self.speed_min is None and self.speed_max is None:
            fastest = self.fastest(task)
            return fastest / 2.0 if fastest * USEFUL_SWEEP[1] < task.span else None
        return self.speed_min

    @property
    def on_the_front(self) -> bool:
        """Whether the front of time and hole is requested."""
        return self.time_budget is not None or self.max_hole is not None

    def _check_alone(self) -> None:
        """Raise ParameterError for options without a meaning on the front."""
        for key, neutral in (('objective', 'completion'), ('top', None)):
            if (value := getattr(self, key)) != neutral:
                raise ParameterError(key, 'left out with --time-budget and --max-hole', value)


_BOUNDS = ('azimuth', 'centre', 'window_min', 'window_max')
_GROUPS: dict[Any, str] = {
    Task: 'object, region and lidar',
    Request: 'the nod',
    ErrorParameters: 'with --error-budget; defaults of encoder and backlash are those of --servo',
}


def parse(argv: Sequence[str] | None) -> tuple[Task, Request, ErrorParameters]:
    """Return the task, the request and the devices' errors of a command line.

    Raises
    ------
    ParameterError
        If a value is not allowed.
    SystemExit
        After --help, or with status 2 and a line on stderr for an unknown option.
    """
    parser = LineParser('plan_scan', _DESCRIPTION)
    for of, title in _GROUPS.items():
        group = parser.add_argument_group(title)
        for option_field in fields(of):
            add_option(group, option_field)
    parser.set_defaults(**SERVO_ERRORS.get(parser.parse_args(argv).servo, {}))
    values = vars(parser.parse_args(argv))
    task, request, errors = ({f.name: values[f.name] for f in fields(of)} for of in _GROUPS)
    _check_full_circle(task)
    return Task(**task), Request(**request), ErrorParameters(**errors)


def _check_full_circle(task: dict[str, Any]) -> None:
    """Raise ParameterError for the bounds of a region or window beside that of a full circle."""
    if task['full_circle']:
        for each in fields(Task):
            if each.name in _BOUNDS and task[each.name] != each.default:
                limit = 'left out with --full-circle, which plans for all directions'
                raise ParameterError(each.name, limit, task[each.name])


def as_option(error: ParameterError) -> ParameterError:
    """Return the error of a field with the name of its option."""
    return ParameterError(flag(error.key), error.limit, error.value)


def objective_of(text: str) -> Objective:
    """Return the objective of a text such as 'revisit' or 'completion=1,hole=10'.

    The weight is 0 for a name that is missing, and 1 for a name alone. `hole_after` is a time [s].

    Raises
    ------
    ParameterError
        If the text is no objective.
    """
    given: dict[str, float] = {}
    for term in text.split(','):
        name, equals, weight = term.partition('=')
        if (name := name.strip()) in given:
            raise ParameterError('objective', f'{_OBJECTIVE}, each once', text)
        given[name] = _number(weight if equals else '1', text)
    weights = {name: given.pop(name, 0.0) for name in ('completion', 'revisit', 'hole')}
    hole_after = given.pop('hole_after', Objective().hole_after)
    if given or not any(weights.values()) or hole_after == 0.0:
        raise ParameterError('objective', _OBJECTIVE, text)
    return Objective(**weights, hole_after=hole_after)


def _number(weight: str, text: str) -> float:
    try:
        value = float(weight)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < float('inf'):
        raise ParameterError('objective', f'{_OBJECTIVE}, none below 0', text)
    return value


def _check_picture(path: Path) -> None:
    if path.suffix.lower() not in PICTURES:
        raise ParameterError('plot', 'a file that ends in ' + ', '.join(PICTURES), str(path))
    writable = path if path.exists() else path.parent
    if path.is_dir() or not path.parent.is_dir() or not os.access(writable, os.W_OK):
        raise ParameterError('plot', 'a file in a writable folder', str(path))
