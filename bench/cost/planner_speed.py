"""How fast the planner's figures of a nod are, against enumeration of all samples."""

from collections.abc import Callable
from pathlib import Path
import sys
import time

from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np

from bench.shared.reference import FULL_CIRCLE, REFERENCE_N_S
from bench.shared.report import Row

# The enumeration that the tests check the planner with.
sys.path.append(str(Path(__file__).parents[2] / 'nodlidar_planner' / 'test'))
from planner_enumeration import enumerate_cells

TITLE = f'Planner: {FULL_CIRCLE.columns} x {FULL_CIRCLE.rows} cells, N_s = {REFERENCE_N_S}'


def results() -> list[Row]:
    """Return the times of both, and their ratio."""
    pattern = Pattern(FULL_CIRCLE.steps_per_revolution, REFERENCE_N_S)
    took = _time(lambda: Coverage(FULL_CIRCLE, pattern).figures(), 30)
    other = _time(lambda: enumerate_cells(FULL_CIRCLE, pattern), 3)
    return [
        {
            'what': 'figures of the whole period',
            'time [ms]': took * 1e3,
            'against': 'enumeration in NumPy',
            'its time [ms]': other * 1e3,
            'ratio': other / took,
        }
    ]


def _time(action: Callable[[], object], repeats: int) -> float:
    """Return the median time of an action [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
