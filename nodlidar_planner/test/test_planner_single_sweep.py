"""One sweep hits every cell, by enumeration of its samples, also with an error of the pitch."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_planner.pattern.nod_speeds import MIN_SPEED, PITCH_ERROR
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.schedule import even_rows
from nodlidar_planner.sweeps.single_sweep import LEAST_ADVANCE, single_sweep
import numpy as np
import pytest

tasks = st.builds(
    lambda low, span, cell: even_rows(
        Task(2.0 * math.sin(cell / 2.0), 1.0, low, low + span, azimuth=1.0)
    ),
    st.floats(-0.8, 0.0),
    st.floats(0.1, 1.5),
    st.floats(0.01, 0.3),
)
coarse = tasks.filter(lambda t: min(t.cell, t.span) >= PITCH_ERROR / (1.0 - LEAST_ADVANCE))


@given(coarse, st.integers(0, 1023), st.integers(0, 2**32 - 1))
def test_one_sweep_hits_every_cell_in_spite_of_an_error_of_the_pitch(task, begin, seed):
    beyond = min(task.cell, task.span) / 2.0  # on either side, as the nod of a region is
    wider = (task.span + 2.0 * beyond) / task.span
    sample = np.arange(math.ceil(single_sweep(task) * wider))
    revolution = sample // 1024
    # Any two revolutions differ by the error at most.
    error = np.random.default_rng(seed).uniform(-0.5, 0.5, revolution[-1] + 1) * PITCH_ERROR
    height = (sample + 0.5) / len(sample) * task.span * wider - beyond + error[revolution]
    column = task.column_of_step()[(begin + sample) % 1024]
    hit = (column >= 0) & (height >= 0.0) & (height <= task.span)
    seen = np.zeros((task.columns, task.rows), dtype=bool)
    seen[column[hit], task.row_of_height(height[hit] / task.span, 1)] = True
    assert seen[np.unique(column[column >= 0])].all()


@given(tasks, st.integers(1, 100_000))
def test_it_is_coprime_and_no_faster_than_the_servo(task, fewest):
    n_s = single_sweep(task, fewest)
    assert n_s >= fewest
    assert math.gcd(n_s, task.steps_per_revolution) == 1
    # No nod needs fewer revolutions than rows; this one not many more.
    assert n_s >= (task.rows - 0.01) * 1024
    assert n_s <= max(task.rows * 1024 / LEAST_ADVANCE, fewest) + 10


def test_it_is_no_slower_than_a_servo_goes():
    fine = even_rows(Task(0.0016, 1.0, -0.5, 0.5, steps_per_revolution=4096, azimuth=1.0))
    assert fine.speed(single_sweep(fine)) == pytest.approx(MIN_SPEED, rel=1e-3)
    assert single_sweep(fine, fewest_samples=10_000_000) >= 10_000_000
