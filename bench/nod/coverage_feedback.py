"""Sweeps chosen for unseen cells against the planned nod, under errors of the reversals.

As in the node, each sweep is chosen while the one before it is under way, and its end is not known
yet. Both nods are measured on the region's own rows, of which the last is lower than a cell and so
seldom hit, and with limits that are wider by the rest of that row.
"""

import time

from nodlidar_planner.choice.timing_error import completion_run
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.pattern.pattern import HALF_SAMPLE
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import Feedback, SPREAD
from nodlidar_planner.sweeps.schedule import whole_rows
import numpy as np

from bench.shared.reference import FULL_CIRCLE, REVERSAL_ERROR
from bench.shared.report import Row

SEEDS = range(50)
TITLE = (
    f'10 cm at 2 m, full circle, span pi/2, reversals {REVERSAL_ERROR * 1e3:.0f} ms off: '
    f'median completion of {len(SEEDS)} runs'
)
# The N_s that is planned, and the nearest coprime one for the nod that keeps to it.
PLANNED = ((2500, 2501), (4001, 4001))


def results() -> list[Row]:
    """Return the median completion of either nod, and how long a choice takes."""
    return [
        _row(name, task, n_s, coprime)
        for name, task in (('as asked', FULL_CIRCLE), ('whole', whole_rows(FULL_CIRCLE)))
        for n_s, coprime in PLANNED
    ]


def _row(name: str, task: Task, n_s: int, coprime: int) -> Row:
    wider = task.span / FULL_CIRCLE.span
    n_s, coprime = round(n_s * wider), round(coprime * wider) | 1
    runs = [_Run(task, n_s, seed) for seed in SEEDS]
    chosen = float(np.median([run.completion for run in runs]))
    steady = [completion_run(task, coprime, HALF_SAMPLE, REVERSAL_ERROR, seed) for seed in SEEDS]
    return {
        'rows': name,
        'N_s': n_s,
        'coprime [s]': float(np.median(steady)),
        'feedback [s]': chosen,
        'ratio': chosen / float(np.median(steady)),
        'lower bound [s]': lower_bound(task, round(n_s * (1.0 - SPREAD))),
        'a choice [ms]': float(np.median([run.seconds for run in runs])) * 1e3,
    }


class _Run:
    """A nod whose sweeps are chosen until all cells were hit.

    Attributes
    ----------
    completion
        The first instant at which every cell was hit [s].
    seconds
        Median time that a choice took [s].
    """

    def __init__(self, task: Task, n_s: int, seed: int) -> None:
        feedback, noise = Feedback(task, n_s, REVERSAL_ERROR), np.random.default_rng(seed)
        # Commanded and true instant of the last reversal, in samples.
        commanded, true, duration, going_up = -HALF_SAMPLE, -HALF_SAMPLE, float(n_s), True
        last, took = 0, []
        while feedback.unseen.any():
            start = time.perf_counter()
            next_commanded = commanded + duration
            under_way = (true, next_commanded - true)
            following = feedback.next_duration(next_commanded, not going_up, under_way)
            took.append(time.perf_counter() - start)
            end = next_commanded + noise.normal(0.0, REVERSAL_ERROR / task.beam_period)
            new = feedback.saw(true, end, going_up)
            last = int(new[-1]) if len(new) else last
            commanded, true, duration, going_up = next_commanded, end, following, not going_up
        self.completion, self.seconds = last * task.beam_period, float(np.median(took))
