"""Nods at the same highest speed: steady ones, and ones whose sweeps differ in duration."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_planner.choice.search import soonest
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.pattern.pattern import HALF_SAMPLE
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import Feedback, SPREAD
from nodlidar_planner.sweeps.schedule import (
    first_hits,
    interlaced,
    rows_of,
    Schedule,
    shortest_interlaced,
    whole_rows,
)
import numpy as np

from bench.shared.reference import FULL_CIRCLE
from bench.shared.report import Row

# The useful band of N_s; the fewest samples in a sweep are the speed limit.
FEWEST, MOST = 1001, 8000
HORIZON = 40.0  # s
RUNS = 20
ERRORS = 0.001, 0.003  # s, standard deviation of the reversals' instants
SHIFTS = np.arange(4) / 4.0
OVERLAP = 0.3
TITLE = f'Nods at the same highest speed ({RUNS} runs with each error)'


@dataclass(frozen=True)
class Nod:
    """A nod: its name, the task whose limits it has, and when it reverses [samples]."""

    name: str
    task: Task
    reversals: Array


def results() -> list[Row]:
    """Return completion, without and with errors, and revisits of each nod."""
    cases = (
        ('2 m, all that was tried', FULL_CIRCLE, FEWEST, _tried()),
        *((f'2 m, N_s >= {n}', FULL_CIRCLE, n, ()) for n in (FEWEST, 1220, 2000, 4001)),
        *((f'{d:.0f} m', replace(FULL_CIRCLE, distance=d), FEWEST, ()) for d in (1.0, 3.0)),
        ("2 m, the lidar's own window", Task(), FEWEST, ()),
    )
    return [
        {'task': name, 'bound [s]': lower_bound(task, fewest), 'nod': nod.name, **_figures(nod)}
        for name, task, fewest, nods in cases
        for nod in nods or _chosen(task, fewest)
    ]


def _chosen(task: Task, fewest: int) -> Iterator[Nod]:
    """Yield the best steady nod, the interlaced ones within the band, and the one of one comb."""
    yield _steady(task, int(_best(task, fewest)))
    wider, at_least = _wider(task, fewest)
    for overlap in (0.0, OVERLAP):
        schedule = shortest_interlaced(wider, at_least, MOST, overlap)
        yield _interlaced_nod(wider, schedule, overlap)
    yield _interlaced_nod(wider, interlaced(wider, at_least, 1, 0.05), 0.05)


def _tried() -> Iterator[Nod]:
    """Yield other nods; the fractional N_s and the pair are the best of a search."""
    yield _steady(FULL_CIRCLE, 2745, 'published: steady 2745')
    yield _steady(FULL_CIRCLE, 7253, 'best at 1 ms: steady 7253')
    yield _steady(FULL_CIRCLE, 7897, 'best at 3 ms: steady 7897')
    yield _steady(FULL_CIRCLE, 1225, 'badly approximable: steady 1225')
    yield _steady(FULL_CIRCLE, 1487.3, 'not whole: steady 1487.3')
    yield _nod('two sweeps: 1794 up, 1083 down', FULL_CIRCLE, Schedule((1794, 1083)))
    yield _planned(1300)
    wider, at_least = _wider(FULL_CIRCLE, FEWEST)
    yield _steady(wider, 5461, 'whole rows, steady 5461')
    yield _steady(wider, 5445, 'whole rows, best at 3 ms: steady 5445')
    yield _steady(wider, 1043, 'whole rows, best wherever: steady 1043')
    yield _interlaced_nod(wider, interlaced(wider, at_least, 4, 0.25), 0.25)


def _wider(task: Task, fewest: int) -> tuple[Task, int]:
    """Return the task with whole rows, and the samples in its sweep at the same speed."""
    wider = whole_rows(task)
    return wider, math.ceil(fewest * wider.span / task.span)


def _best(task: Task, fewest: int) -> int:
    odd = np.arange(fewest | 1, MOST + 1, 2)
    return int(soonest(task, odd)[0][0])


def _steady(task: Task, n_s: float, name: str = '') -> Nod:
    sweeps = np.arange(math.ceil(HORIZON / task.beam_period / n_s) + 2, dtype=np.float64)
    return Nod(name or f'steady {n_s}', task, sweeps * n_s - HALF_SAMPLE)


def _nod(name: str, task: Task, schedule: Schedule) -> Nod:
    return Nod(name, task, schedule.reversals(int(HORIZON / task.beam_period)))


def _interlaced_nod(task: Task, schedule: Schedule, overlap: float) -> Nod:
    combs = len(schedule.sweeps) // 2
    up, down = schedule.sweeps[:2]
    return _nod(f'interlaced {combs} x ({up} up, {down} down), {overlap:.0%}', task, schedule)


def _planned(base: int) -> Nod:
    """Return a nod whose sweeps are each chosen in advance for the most unseen cells."""
    feedback = Feedback(FULL_CIRCLE, base, timing_error=0.0)
    reversals = [-HALF_SAMPLE]
    while reversals[-1] * FULL_CIRCLE.beam_period < HORIZON:
        going_up = len(reversals) % 2 == 1
        reversals.append(reversals[-1] + feedback.next_duration(reversals[-1], going_up))
        feedback.saw(reversals[-2], reversals[-1], going_up)
        if not feedback.unseen.any():
            feedback.forget()
    return Nod(f'each sweep planned, {base} +- {SPREAD:.0%}', FULL_CIRCLE, np.array(reversals))


def _figures(nod: Nod) -> Row:
    return {
        'complete [s]': first_hits(nod.task, nod.reversals).max() * nod.task.beam_period,
        'wherever it lies [s]': _wherever(nod) if nod.task.full_circle else None,
        **{
            f'{error * 1e3:g} ms [s]': float(
                np.median([_with_error(nod, error, k) for k in range(RUNS)])
            )
            for error in ERRORS
        },
        'revisit [s]': _longest_revisit(nod),
    }


def _with_error(nod: Nod, error: float, seed: int) -> float:
    """Return the completion time when the reversals are off by white noise [s]."""
    noise = np.random.default_rng([5, seed]).normal(0.0, error, len(nod.reversals))
    reversals = np.maximum.accumulate(nod.reversals + noise / nod.task.beam_period)
    reversals[0] = min(reversals[0], 0.0)
    reversals += np.arange(len(reversals)) * 1e-6  # np.interp allows no sweep without length
    return float(first_hits(nod.task, reversals).max()) * nod.task.beam_period


def _samples(nod: Nod) -> Integers:
    return np.arange(int(HORIZON / nod.task.beam_period))


def _wherever(nod: Nod) -> float:
    """Return the completion time for the worst of 16 shifts of the cells, whole cells only [s]."""
    task, n = nod.task, _samples(nod)
    sweeps = np.interp(n, nod.reversals, np.arange(len(nod.reversals))) % 2.0
    row = (1.0 - np.abs(sweeps - 1.0)) * (task.span / task.cell)
    column = n % task.steps_per_revolution * (math.tau / task.steps_per_revolution) / task.cell
    rows, columns = math.floor(task.span / task.cell + 1e-9), math.floor(math.tau / task.cell)
    shifted = (
        _grid(row - r, column - c, rows - (r > 0), columns - (c > 0))
        for r in SHIFTS
        for c in SHIFTS
    )
    return max(shifted) * task.beam_period


def _grid(row: Array, column: Array, rows: int, columns: int) -> float:
    """Return the first sample by which all cells of a grid are hit."""
    row, column = np.floor(row + 1e-9), np.floor(column)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    n = np.flatnonzero(inside)
    first = np.full(rows * columns, np.inf)
    first[(column[n] * rows + row[n]).astype(np.int64)[::-1]] = n[::-1]
    return float(first.max())


def _longest_revisit(nod: Nod) -> float:
    """Return the longest time between crossings of a cell within the horizon [s]."""
    task, n = nod.task, _samples(nod)
    column = task.column_of_step()[n % task.steps_per_revolution]
    cell = np.where(column >= 0, column * task.rows + rows_of(task, nod.reversals, n), -1)
    begins = np.flatnonzero((cell != np.roll(cell, 1)) & (cell >= 0))
    begins = begins[np.argsort(cell[begins], kind='stable')]
    gap = np.diff(begins)[np.diff(cell[begins]) == 0]
    return float(gap.max()) * task.beam_period
