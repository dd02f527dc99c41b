"""Plans in words: values with units, and notes for the user of a plan."""

from collections.abc import Iterator
import math

from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.plan import Plan
from nodlidar_planner.holes.hole import largest_hole
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS
from nodlidar_planner.pattern.pattern import HALF_SAMPLE, Pattern
from nodlidar_planner.pattern.task import STEEPEST, Task
import numpy as np

LOW_ROW = 0.5  # height of a last row that delays completion [cells]


def notes(task: Task, plan: Plan, servo: str) -> list[str]:
    """Return notes for the user of a plan with a servo."""
    between = _between_cells(task, plan)
    return [*_unseen(task, plan), *between, *_hard_for_the_servo(task, plan, servo)]


def number(value: float) -> str:
    """Return a number with four digits, or with all digits before the point."""
    if not math.isfinite(value):
        return 'never'
    return f'{value:.4g}' if abs(value) < 1e4 else f'{value:.0f}'


def seconds(value: float) -> str:
    """Return a time with its unit, or 'never'."""
    return f'{number(value)} s' if math.isfinite(value) else 'never'


def angle(value: float) -> str:
    """Return an angle in radians and degrees."""
    return f'{number(value)} rad ({math.degrees(value):.2f}°)'


def _unseen(task: Task, plan: Plan) -> Iterator[str]:
    if task.distance > task.range_max:
        yield (
            f'the lidar sees {number(task.range_max)} m far, not {number(task.distance)} m: '
            f'--range-max is for another one'
        )
    share = plan.figures.never_hit_share
    if share > 0.0:
        late = plan.under_error is not None and math.isfinite(plan.under_error.median)
        errors = ' without timing error' if late else ''
        yield f'{100.0 * share:.3g} % of the cells are never hit, so it never completes{errors}'
    measured = task.column_of_step()
    columns = len(np.unique(measured[measured >= 0]))
    if columns < task.columns:
        yield (
            f'the lidar has beams in {columns} of the {task.columns} columns: the others are '
            f'outside its view or narrower than its step of '
            f'{angle(math.tau / task.steps_per_revolution)}'
        )
    if task.rows > 1 and task.last_row < LOW_ROW:
        yield (
            f'the last row is {task.last_row:.2g} of a cell high, so beams seldom hit it and '
            f'completion waits for it: {_whole_rows(task)}'
        )
    if plan.samples_per_sweep < task.rows:
        yield f'a sweep of {plan.samples_per_sweep} samples cannot hit {task.rows} rows'
    half_sample = Pattern(task.steps_per_revolution, plan.samples_per_sweep, HALF_SAMPLE)
    if half_sample.repeats > 1:
        common = math.gcd(plan.samples_per_sweep, task.steps_per_revolution)
        yield (
            f'N_s = {plan.samples_per_sweep} and the {task.steps_per_revolution} steps of a '
            f'revolution have the common divisor {common}: the pattern repeats '
            f'{half_sample.repeats} times sooner than without it'
        )
    if plan.distinct_directions < half_sample.distinct_directions:
        yield (
            f'upward and downward legs share directions; without --start-pitch, which starts half '
            f'a sample past a limit, {half_sample.distinct_directions} are distinct'
        )


def _between_cells(task: Task, plan: Plan) -> Iterator[str]:
    """Yield a note if an object may lie unseen between cells that are all hit."""
    completion = plan.figures.completion_time
    if not math.isfinite(completion):
        return
    pattern = Pattern(task.steps_per_revolution, plan.samples_per_sweep, plan.phase)
    try:
        hole = largest_hole(task, pattern, completion).side
    except ParameterError:  # too long to compute
        return
    if hole >= task.cell:
        yield (
            f'after {seconds(completion)}, an empty square of {hole / task.cell:.2g} cells is '
            f'left between cells that are all hit: --max-hole finds a nod for objects anywhere'
        )


def _whole_rows(task: Task) -> str:
    """Return the option that makes the last row whole or, beyond the range, leaves it out."""
    highest = task.pitch_min + task.rows * task.cell
    if highest <= STEEPEST:
        return f'with --pitch-max {highest:.5f} it is whole'
    return f'with --pitch-max {highest - task.cell:.5f} it is left out'


def _hard_for_the_servo(task: Task, plan: Plan, servo: str) -> Iterator[str]:
    if plan.speed > MAX_SPEEDS[servo]:
        yield (
            f'with a lidar on it, the servo {servo} nods at {MAX_SPEEDS[servo]:g} rad/s at most; '
            f'--servo names another one'
        )
    yield from _hard_to_reverse(task, plan)
    row_time = task.row_height(plan.samples_per_sweep) * task.beam_period
    if plan.under_error is not None and row_time < plan.under_error.error:
        yield (
            f'the nod passes a row in {row_time * 1e3:.2g} ms, less than the timing error: which '
            f'rows it hits is random'
        )


def _hard_to_reverse(task: Task, plan: Plan) -> Iterator[str]:
    """Yield a note if the reversals, parabolas in time, take longer than a sweep or lose a row."""
    duration = 2.0 * plan.speed / REVERSAL_ACCELERATION
    short = plan.speed**2 / (2.0 * REVERSAL_ACCELERATION)
    outermost = task.cell * min(1.0, task.last_row)
    if duration > plan.sweep_duration:
        yield (
            f'a reversal at {REVERSAL_ACCELERATION:g} rad/s², which is assumed for every servo, '
            f'takes {seconds(duration)}: more than a sweep'
        )
    elif short > outermost:
        yield (
            f'at {REVERSAL_ACCELERATION:g} rad/s², which is assumed for every servo, the nod '
            f'reverses {angle(short)} short of the limits and misses the outermost row: widen the '
            f'limits by as much'
        )
