"""Sweeps chosen for what is unseen against the planned nod, under errors of the turns."""

import time

from nodlidar_assembler.planner.choice import lower_bound
from nodlidar_assembler.planner.feedback import Feedback, SPREAD
from nodlidar_assembler.planner.pattern import HALF_SAMPLE
from nodlidar_assembler.planner.timing_error import completion_run
import numpy as np
from rich.table import Table

from bench.reference import FULL_CIRCLE

SEEDS = range(50)


def table() -> Table:
    """Return the median completion of either, and how long a choice takes."""
    result = Table(
        title=f'10 cm at 2 m, full circle, span pi/2: median completion of {len(SEEDS)} runs'
    )
    for heading in ('N_s', 'error', 'coprime', 'feedback', 'ratio', 'lower bound', 'a choice'):
        result.add_column(heading, justify='right')
    for n_s, planned in ((2500, 2501), (4001, 4001)):
        for error in (0.0, 0.001, 0.003, 0.008):
            runs = [_feedback_run(n_s, error, seed) for seed in SEEDS]
            chosen = float(np.median([completion for completion, _ in runs]))
            steady = float(
                np.median(
                    [completion_run(FULL_CIRCLE, planned, HALF_SAMPLE, error, s) for s in SEEDS]
                )
            )
            result.add_row(
                f'{n_s}',
                f'{error * 1e3:g} ms',
                f'{steady:.1f} s',
                f'{chosen:.1f} s',
                f'{chosen / steady:.2f}',
                f'{lower_bound(FULL_CIRCLE, round(n_s * (1.0 - SPREAD))):.1f} s',
                f'{np.median([seconds for _, seconds in runs]) * 1e3:.0f} ms',
            )
    return result


def _feedback_run(n_s: int, error: float, seed: int) -> tuple[float, float]:
    """Return the completion time of a run [s], and the median time that a choice takes [s]."""
    feedback, noise = Feedback(FULL_CIRCLE, n_s, error), np.random.default_rng(seed)
    turn, going_up, last, took = -HALF_SAMPLE, True, 0, []
    while feedback.unseen.any():
        start = time.perf_counter()
        duration = feedback.next_duration(turn, going_up)
        took.append(time.perf_counter() - start)
        following = turn + duration + noise.normal(0.0, error / FULL_CIRCLE.sample_time)
        new = feedback.saw(turn, following, going_up)
        last = int(new[-1]) if len(new) else last
        turn, going_up = following, not going_up
    return last * FULL_CIRCLE.sample_time, float(np.median(took))
