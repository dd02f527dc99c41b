"""How fast the planner is, against going through all samples, or through all N_s."""

from collections.abc import Callable
from functools import partial
from math import pi, radians
from pathlib import Path
import sys
import time

from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.choice.front import Front
from nodlidar_planner.choice.objective import HOLE_AFTER
from nodlidar_planner.choice.survey import survey
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.holes.hole import largest_hole
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np

from bench.reference import FULL_CIRCLE
from bench.report import Row
from figures.coverage import maps_of, STARTS

# The enumeration that the tests check the planner with.
sys.path.append(str(Path(__file__).parent.parent / 'nodlidar_planner' / 'test'))
from planner_enumeration import enumerate_cells

TASKS = {
    '10 cm at 2 m, full circle, span pi/2': FULL_CIRCLE,
    "10 cm at 2 m, the lidar's own view": Task(),
    '10 cm at 3 m, full circle, span pi/2': Task(0.10, 3.0, -pi / 4, pi / 4, full_circle=True),
}
# Of so many N_s of the Fig. 6 grid, one is computed.
GRID_PART = 50
TITLE = 'Planner: 126 x 32 cells, N_s = 4001, unless another task is named'


def results() -> list[Row]:
    """Return times and their ratios."""
    pattern = Pattern(1024, 4001)
    structure = _time(lambda: Coverage(FULL_CIRCLE, pattern).figures(), 30)
    enumeration = _time(lambda: enumerate_cells(FULL_CIRCLE, pattern), 3)
    hole = _time(lambda: largest_hole(FULL_CIRCLE, pattern, 10.0), 10)
    rows = [
        _row('figures of the whole period', structure, 'enumeration in NumPy', enumeration),
        _row('largest hole after 10 s', hole, 'enumeration in NumPy', enumeration),
    ]
    for name, task in TASKS.items():
        samples = samples_in_band(task)
        everything = _time(partial(survey, task, samples[::35]), 1) * 35
        for error in (0.0, 0.003):
            choice = _time(partial(quick_choice, task, samples, error), 5)
            what = f'choice of {len(samples)} N_s, {error * 1e3:g} ms of error: {name}'
            rows.append(_row(what, choice, 'figures of each', everything))
    rows += _front_rows(Task())
    samples = samples_in_band(FULL_CIRCLE)[::GRID_PART]
    grid = _time(lambda: [maps_of(FULL_CIRCLE, int(n_s)) for n_s in samples], 1) * GRID_PART
    what = f'Fig. 6: {GRID_PART * len(samples)} N_s x {len(STARTS)} starts, one process'
    rows.append(_row(what, grid, 'enumeration of each', enumeration * len(STARTS) * 3500))
    return rows


def _front_rows(task: Task) -> list[Row]:
    samples = samples_in_band(task)
    patterns = [Pattern(task.steps_per_revolution, int(n_s)) for n_s in samples[::35]]
    holes = _time(lambda: [largest_hole(task, p, HOLE_AFTER) for p in patterns], 1) * 35
    front, angle = Front(task, samples), radians(2.0)
    smallest, soonest = (
        _time(find, 3)
        for find in (lambda: front.within(HOLE_AFTER), lambda: front.reaching(angle))
    )
    other, all_of = f'hole of each after {HOLE_AFTER:g} s', f'of {len(samples)} N_s'
    return [
        _row(f'the smallest hole {all_of} after {HOLE_AFTER:g} s', smallest, other, holes),
        _row(f'the soonest {all_of} without a hole of 2°', soonest, other, holes),
    ]


def _row(what: str, took: float, other: str, other_took: float) -> Row:
    return {
        'what': what,
        'time [ms]': took * 1e3,
        'against': other,
        'its time [ms]': other_took * 1e3,
        'ratio': other_took / took,
    }


def _time(action: Callable[[], object], repeats: int) -> float:
    """Return the median time of an action [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
