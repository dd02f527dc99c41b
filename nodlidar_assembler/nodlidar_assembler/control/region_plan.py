"""A region to be scanned: its cells, the nod that sees them, and how long that takes."""

from dataclasses import dataclass, fields, replace
import math

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_common.arrays import Array
from nodlidar_common.dynamics import check_pitch
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.rounding import rounded_up
from nodlidar_planner.choice.timing_error import completion_run
from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.pattern.pattern import HALF_SAMPLE
from nodlidar_planner.pattern.task import no_less_than, size_of, Task, wrapped
from nodlidar_planner.sweeps.schedule import even_rows
from nodlidar_planner.sweeps.single_sweep import single_sweep
import numpy as np

LONGEST = 600.0
"""Longest time limit [s]."""

# The nod goes beyond the region by this part of a cell, but at least by this [rad], where the
# mount allows it: a servo rounds its reversals, and is late at the first one.
BEYOND, LEAST_BEYOND = 0.5, 0.01
# Seeds of the runs of which the predicted time is the median. There are fewer with more cells, so
# that the command of the nod does not wait; a single sweep always takes nearly the same time.
RUNS, CELLS_OF_RUNS = range(3000, 3015), 60_000
MOST_CELLS = 400_000
_ROUNDING = 1e-6  # of azimuths in the goal [rad]


class RegionError(NodlidarError):
    """A region that cannot be scanned now, whichever it is."""


@dataclass(frozen=True, slots=True)
class Region:
    """What to scan, as in the goal of the action.

    Zeros stand for the values of the parameters; those of the limits only if both are.

    Raises
    ------
    ParameterError
        If a value is not finite, or out of its range.
    """

    pitch_min: float = 0.0
    pitch_max: float = 0.0
    azimuth_min: float = 0.0
    azimuth_max: float = 0.0
    object_size: float = 0.0
    object_distance: float = 0.0
    cell: float = 0.0
    time_limit: float = 0.0

    def __post_init__(self) -> None:
        for key in (field.name for field in fields(self)):
            value = getattr(self, key)
            if not math.isfinite(value):
                raise ParameterError(key, 'finite', value)
            if value < 0.0 and not key.startswith(('pitch', 'azimuth')):
                raise ParameterError(key, 'at least 0', value)
        if self.time_limit > LONGEST:
            raise ParameterError('time_limit', f'at most {LONGEST:g} s', self.time_limit)
        if self.cell > 1.0:
            raise ParameterError('cell', 'at most 1 rad', self.cell)


@dataclass(frozen=True, slots=True, eq=False)
class RegionPlan:
    """How a region is scanned.

    Attributes
    ----------
    task
        The region and its cells.
    shape
        The nod.
    runs
        Times from its beginning until every cell is seen, in simulated runs, ascending [s].
    time_limit
        The one in the goal [s].
    """

    task: Task
    shape: NodShape
    runs: Array
    time_limit: float

    @property
    def sweep(self) -> float:
        """Duration of a sweep of the nod [s]."""
        return self.shape.samples_per_sweep * self.task.beam_period


def region_plan(
    region: Region, config: NodConfig, view: Task, limits: tuple[float, float], step: float = 0.0
) -> RegionPlan:
    """Return the nod that sees a region soonest.

    Parameters
    ----------
    region
        What to scan.
    config
        The nod at other times, and the servo.
    view
        The cells in the whole window of the lidar.
    limits
        Lowest and highest pitch that the mount allows [rad].
    step
        Between two beams of the lidar [rad], if it leaves out steps.

    Raises
    ------
    ParameterError
        If the region is beyond the limits of the mount or the view of the lidar, or narrower than
        a step of it, or the object is too small for its steps or for MOST_CELLS.
    """
    bounded = _in_view(_in_limits(region, config, view, limits), region)
    task = _with_cells(bounded, region, config, max(step, math.tau / view.steps_per_revolution))
    beyond = max(BEYOND * task.cell, LEAST_BEYOND)
    low, high = max(task.pitch_min - beyond, limits[0]), min(task.pitch_max + beyond, limits[1])
    wider = (high - low) / task.span
    fewest = config.fewest_samples(high - low, task.beam_period)
    within = single_sweep(task, math.ceil(fewest / wider))
    samples = coprime_from(math.ceil(within * wider), task.steps_per_revolution)
    longest_way = max(task.pitch_min - low, high - task.pitch_max)
    before = longest_way / (high - low) * samples * task.beam_period
    error, seeds = config.timing_error, RUNS[: max(1, CELLS_OF_RUNS // task.cells)]
    runs = [completion_run(task, within, HALF_SAMPLE, error, seed) for seed in seeds]
    return RegionPlan(
        task, NodShape(low, high, samples), before + np.sort(runs), region.time_limit
    )


def _in_limits(region: Region, config: NodConfig, view: Task, limits: tuple[float, float]) -> Task:
    """Return the view between the pitch limits of the region."""
    low, high = region.pitch_min, region.pitch_max
    if low == high == 0.0:
        low, high = config.pitch_min, config.pitch_max
    for key, pitch in (('pitch_min', low), ('pitch_max', high)):
        check_pitch(key, pitch, limits)
    return replace(view, pitch_min=low, pitch_max=high)


def _in_view(view: Task, region: Region) -> Task:
    """Return the part of the view between the azimuths of the region."""
    low, high = region.azimuth_min, region.azimuth_max
    if low == high == 0.0:
        return view
    if not 0.0 < high - low <= math.tau:
        limit = f'above azimuth_min = {low:g} rad, by a whole turn at most'
        raise ParameterError('azimuth_max', limit, high)
    if view.full_circle and high - low > math.tau - _ROUNDING:
        return view
    begin = (low - view.window_min + _ROUNDING) % math.tau - _ROUNDING
    seen = math.tau if view.full_circle else view.window_max - view.window_min
    if begin > seen or (begin + high - low > seen + _ROUNDING and not view.full_circle):
        key, azimuth = ('azimuth_min', low) if begin > seen else ('azimuth_max', high)
        window = f'{view.window_min:.4f} to {view.window_max:.4f} rad'
        raise ParameterError(key, f'in the view of the lidar, {window}', azimuth)
    centre = wrapped((low + high) / 2.0)
    return replace(view, azimuth=(high - low) / 2.0, centre=centre, full_circle=False)


def _with_cells(task: Task, region: Region, config: NodConfig, step: float) -> Task:
    """Return the task with equally high rows of cells, each of whose columns has a beam."""
    for key, width in (('pitch_max', task.span), ('azimuth_max', 2.0 * task.azimuth)):
        if width < step:
            limit = f'above {key[:-3]}min by at least {rounded_up(step)} rad, a step of the lidar'
            raise ParameterError(key, limit, getattr(region, key))
    if region.cell:
        if region.cell < step:
            raise _too_small(region, 1.0, step)
        size, distance = size_of(region.cell, 1.0), 1.0
    else:
        size = region.object_size or config.object_size
        distance = region.object_distance or config.object_distance
    try:
        task = replace(task, object_size=size, distance=distance)
    except ParameterError as error:
        if error.key != 'distance':
            raise
        raise ParameterError('object_distance', error.limit, error.value) from error
    if task.cell < step:
        raise _too_small(region, distance, step)
    even = even_rows(task)
    task = even if even.cell >= step else task
    if task.cells > MOST_CELLS:
        key = 'cell' if region.cell else 'object_size'
        limit = f'so large that the region has at most {MOST_CELLS} cells'
        raise ParameterError(key, limit, region.cell or size)
    return _without_sliver(task, step)


def _without_sliver(task: Task, step: float) -> Task:
    """Return the task without a last column narrower than a step, which may have no beam."""
    rest = 2.0 * task.azimuth - (task.columns - 1) * task.cell
    if task.full_circle or task.columns == 1 or rest >= step:
        return task
    half = rest / 2.0
    return replace(task, azimuth=task.azimuth - half, centre=wrapped(task.centre - half))


def _too_small(region: Region, distance: float, step: float) -> ParameterError:
    if region.cell:
        limit = f'at least {rounded_up(step)} rad, a step of the lidar'
        return ParameterError('cell', limit, region.cell)
    return ParameterError('object_size', no_less_than(step, distance), region.object_size)
