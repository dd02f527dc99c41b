"""The published N_s = 2745 against all odd N_s, over the distance, which is not published.

Full circle, span pi/2, an object of 10 cm, no timing error: the task of Fig. 6. An N_s is faster
if it has hit every cell earlier.
"""

from concurrent.futures import ProcessPoolExecutor
import math

from nodlidar_planner.coverage.coverage import Coverage, Figures
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np

from bench.shared.report import Row

TITLE = 'N_s = 2745 over the distance: 10 cm, full circle, span pi/2, odd N_s from 1001 to 7999'
PUBLISHED = 2745
DISTANCES = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0)


def results() -> list[Row]:
    """Return a row for each distance."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(_row, DISTANCES))


def task_at(distance: float) -> Task:
    """Return the task of Fig. 6 at a distance [m]."""
    return Task(0.10, distance, -math.pi / 4, math.pi / 4, full_circle=True)


def figures_of(task: Task, samples_per_sweep: int) -> Figures:
    """Return the figures at half a sample of phase."""
    return Coverage(task, Pattern(task.steps_per_revolution, samples_per_sweep)).figures()


def _row(distance: float) -> Row:
    task = task_at(distance)
    samples = samples_in_band(task)
    times = np.array([figures_of(task, int(n_s)).completion_time for n_s in samples])
    published = float(times[samples == PUBLISHED][0])
    return {
        'distance [m]': distance,
        'cells': task.cells,
        f'N_s = {PUBLISHED} [s]': published,
        'median [s]': float(np.median(times)),
        'best [s]': float(times.min()),
        'best N_s': int(samples[np.argmin(times)]),
        'faster N_s [%]': 100.0 * float(np.mean(times < published)),
    }
