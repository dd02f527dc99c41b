"""The output of plan_scan: plans as tables and as a JSON object."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
import math
from typing import Any

from nodlidar_planner.choice.front import Corner
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import Plan
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.error_report import error_json, ErrorReport, print_error_report
from nodlidar_planner.plan_scan.words import angle, notes, number, seconds
import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of plan_scan.

    Attributes
    ----------
    task, objective, servo
        As requested.
    plans
        Best first, at least one.
    nominal
        The plan that is best without timing error, evaluated with it; None without timing error or
        choice.
    front
        Corners of the front of time and largest hole, if requested; includes the plan's.
    errors
        Error budget of the best plan, if requested.
    """

    task: Task
    objective: Objective
    servo: str
    plans: list[Plan]
    nominal: Plan | None = None
    front: Sequence[Corner] = ()
    errors: ErrorReport | None = None


def start_pitch(task: Task, plan: Plan) -> float:
    """Return the pitch of a plan's sample 0 [rad]."""
    pattern = Pattern(task.steps_per_revolution, plan.samples_per_sweep, plan.phase)
    return float(pattern.pitch(0, task.pitch_min, task.pitch_max))


def print_answer(answer: Answer, console: Console) -> None:
    """Print the best plan, notes, and the next best plans or the front."""
    table = Table(
        box=box.SIMPLE, show_header=False, title=_title(answer.task), title_justify='left'
    )
    for row in [*_plan_rows(answer), *_error_rows(answer)]:
        table.add_row(*row)
    console.print(table)
    for note in notes(answer.task, answer.plans[0], answer.servo):
        console.print(f'Note: {note}')
    if len(answer.plans) > 1:
        console.print(_plans_table(answer))
    if answer.front:
        console.print(_front_table(answer))
    if answer.errors is not None:
        print_error_report(answer.errors, console)


def as_json(answer: Answer, alternatives: bool) -> dict[str, Any]:
    """Return the best plan as an object for JSON, in SI units, with None for infinite values."""
    task, [best, *others] = answer.task, answer.plans
    result = _plan_json(task, best)
    result |= {'columns': task.columns, 'rows': task.rows, 'cell': task.cell}
    result |= {'hole_after': answer.objective.hole_after}
    result['notes'] = notes(task, best, answer.servo)
    result['nominal'] = answer.nominal and _plan_json(task, answer.nominal)
    result['error_budget'] = answer.errors and error_json(answer.errors)
    result['front'] = [asdict(corner) for corner in answer.front]
    if alternatives:
        result['alternatives'] = [_plan_json(task, plan) for plan in others]
    return result


def _plan_json(task: Task, plan: Plan) -> dict[str, Any]:
    values = asdict(plan)
    values |= values.pop('figures')
    values['start_pitch'] = start_pitch(task, plan)
    return {key: _finite(value) for key, value in values.items()}


def _finite(value: Any) -> Any:
    """Return a value with None for infinities: JSON has none."""
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _title(task: Task) -> str:
    return f'Finding {number(task.object_size)} m from {number(task.distance)} m'


def _plan_rows(answer: Answer) -> Iterator[tuple[str, str]]:
    task, plan = answer.task, answer.plans[0]
    figures, pitch = plan.figures, start_pitch(task, plan)
    directions = task.steps_per_revolution * plan.samples_per_sweep
    yield 'samples per sweep (N_s)', f'{plan.samples_per_sweep}'
    yield 'speed', f'{number(plan.speed)} rad/s ({math.degrees(plan.speed):.1f}°/s)'
    yield 'sweep', f'{seconds(plan.sweep_duration)} from limit to limit'
    yield 'start at step 0', f'{angle(pitch)}, {number(plan.phase)} samples past the lower limit'
    yield 'every cell hit once after', seconds(figures.completion_time)
    yield 'lower bound, allowed speeds', f'{seconds(plan.lower_bound)}{_against_bound(plan)}'
    revisit = f'{seconds(figures.revisit_max)}, {seconds(figures.revisit_mean)} on average'
    yield 'a cell is hit again within', revisit
    yield 'hits of a cell', f'{number(figures.hit_frequency)} Hz on average'
    cells = f'{figures.cells} = {task.columns} x {task.rows}'
    yield 'cells, columns x rows', f'{cells} of {angle(task.cell)}'
    wide = number(_width(task, plan.hole))
    hole = f'{angle(plan.hole)}: {wide} m wide at {number(task.distance)} m'
    yield f'largest hole after {seconds(answer.objective.hole_after)}', hole
    share = '' if plan.distinct_directions == directions else f' of {directions}'
    yield 'distinct directions', f'{plan.distinct_directions}{share}'


def _against_bound(plan: Plan) -> str:
    ratio = plan.figures.completion_time / plan.lower_bound if plan.lower_bound > 0.0 else np.inf
    return f'; this takes {ratio:.2f} times as long' if np.isfinite(ratio) else ''


def _error_rows(answer: Answer) -> Iterator[tuple[str, str]]:
    """Yield the figures under the timing error of the best plan, and of the nominal one."""
    best, nominal = answer.plans[0], answer.nominal
    if best.under_error is None:
        return
    yield '', ''
    yield f'under {best.under_error.error * 1e3:g} ms of timing error', _completions(best)
    yield 'and the largest hole', _holes(best)
    if nominal is None or nominal.under_error is None:
        return
    if nominal.samples_per_sweep == best.samples_per_sweep:
        yield 'loss against the nominal best', 'none: it is the same'
        return
    name = f'N_s = {nominal.samples_per_sweep}'
    lost = best.figures.completion_time - nominal.figures.completion_time
    yield (
        f'the nominal best, {name}',
        f'{seconds(nominal.figures.completion_time)} without error, {seconds(lost)} sooner',
    )
    yield 'and under that error', _completions(nominal)
    ratio = nominal.under_error.median / best.under_error.median
    if math.isfinite(ratio):
        gain = 'none' if number(ratio) == '1' else f'{number(ratio)} times as fast (median)'
        yield 'gain by planning for it', gain


def _completions(plan: Plan) -> str:
    times = plan.under_error
    assert times is not None
    some_never = math.isinf(times.expected) and math.isfinite(times.median)
    expected = 'never in some runs' if some_never else f'{seconds(times.expected)} (expected)'
    return f'{seconds(times.median)} (median), {expected}, {seconds(times.p90)} (90 %)'


def _holes(plan: Plan) -> str:
    assert plan.hole_under_error is not None
    median, p90 = (angle(getattr(plan.hole_under_error, name)) for name in ('median', 'p90'))
    return f'{median} (median), {p90} (90 %)'


def _plans_table(answer: Answer) -> Table:
    table = Table(box=box.SIMPLE, title=f'The best {len(answer.plans)}', title_justify='left')
    headings = ['N_s', 'speed\nrad/s', 'complete\ns', 'revisit max\ns', 'mean\ns', 'hits\nHz']
    headings.append('hole\nrad')
    if answer.plans[0].under_error is not None:
        headings += ['median\ns', 'expected\ns', '90 %\ns']
    for heading in headings:
        table.add_column(heading, justify='right')
    for plan in answer.plans:
        table.add_row(str(plan.samples_per_sweep), *map(number, _columns(plan)))
    return table


def _front_table(answer: Answer) -> Table:
    task, [plan] = answer.task, answer.plans
    title = 'The smallest holes'
    if plan.under_error is not None:
        title += f' under {plan.under_error.error * 1e3:g} ms of timing error, medians'
    table = Table(box=box.SIMPLE, title=title, title_justify='left')
    at_distance = f'wide at {number(task.distance)} m\nm'
    for heading in ('N_s', 'speed\nrad/s', 'after\ns', 'hole\nrad', 'hole\n°', at_distance, ''):
        table.add_column(heading, justify='right')
    for corner in answer.front:
        n_s, hole = corner.samples_per_sweep, corner.hole
        values = task.speed(n_s), corner.time, hole, math.degrees(hole), _width(task, hole)
        here = n_s == plan.samples_per_sweep and corner.time == answer.objective.hole_after
        table.add_row(str(n_s), *map(number, values), 'chosen' if here else '')
    return table


def _width(task: Task, angle: float) -> float:
    """Return the width [m] that subtends an angle [rad] at the task's distance."""
    return 2.0 * task.distance * math.sin(angle / 2.0)


def _columns(plan: Plan) -> list[float]:
    f, error = plan.figures, plan.under_error
    columns = [plan.speed, f.completion_time, f.revisit_max, f.revisit_mean, f.hit_frequency]
    columns.append(plan.hole)
    return columns if error is None else [*columns, error.median, error.expected, error.p90]
