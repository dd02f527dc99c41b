"""Runs of a nod whose reversals are late."""

import math

from nodlidar_planner.choice import timing_error
from nodlidar_planner.choice.timing_error import completion_run, reversal_instants
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import enumerate_cells, PUBLISHED
import pytest

STEP_0_AHEAD = {'window_min': -math.pi, 'window_max': math.pi, 'azimuth_of_step_0': 0.0}


def test_a_run_without_error_completes_as_in_coverage():
    for task in (PUBLISHED, Task(), Task(distance=1.0, steps_per_revolution=1440)):
        for n_s in (1001, 2747, 4001, 7999):
            exact = Coverage(task, Pattern(task.steps_per_revolution, n_s)).completion_time()
            run = completion_run(task, n_s, 0.5, 0.0, seed=1)
            assert exact - 10 * task.beam_period <= run <= exact + 1e-12


@pytest.mark.parametrize('azimuth', [0.9, 1.249, 2.0])
def test_a_run_counts_what_is_hit_before_the_lidar_first_enters_the_column_of_step_0(azimuth):
    task = Task(0.5, 1.0, azimuth=azimuth, steps_per_revolution=360, **STEP_0_AHEAD)
    for n_s in range(601, 1100, 14):
        exact = enumerate_cells(task, Pattern(360, n_s)).first.max() * task.beam_period
        run = completion_run(task, n_s, 0.5, 0.0, seed=1)
        assert exact - 30 * task.beam_period <= run <= exact + 1e-12  # a column is 29 steps wide


@pytest.mark.parametrize('n_s', [1057, 4001, 7987])
@pytest.mark.parametrize('error', [0.001, 0.008])
def test_a_run_takes_as_long_as_its_samples_enumerated(n_s, error):
    task = PUBLISHED
    expected = enumerated_run(task, n_s, error, 60.0, seed=7)
    assert completion_run(task, n_s, 0.5, error, seed=7) == pytest.approx(expected, abs=0.001)


LOW_LAST_ROW = Task(pitch_max=0.5875)  # of 0.02 cells


@pytest.mark.parametrize(
    ('task', 'n_s'),
    [(Task(), 3), (Task(), 11), (PUBLISHED, 17), (LOW_LAST_ROW, 1001)],
)
def test_a_run_whose_rows_are_lower_than_a_sample_is_its_samples_enumerated(task, n_s):
    expected = enumerated_run(task, n_s, 0.003, 300.0, seed=3)
    assert completion_run(task, n_s, 0.5, 0.003, seed=3) == expected


@pytest.mark.parametrize(
    ('n_l', 'n_s', 'pitch_max'), [(70, 9, 0.6), (70, 9, 0.3), (81, 7, 0.6), (64, 9, 1.0)]
)
def test_several_sweeps_in_a_pass_of_a_column_hit_all_its_rows(n_l, n_s, pitch_max):
    """A pass counts from its first sample, so a run ends earlier by up to a pass."""
    task = Task(1.0, 1.0, -1.0, pitch_max, azimuth=1.5, steps_per_revolution=n_l)
    expected = enumerated_run(task, n_s, 0.003, 60.0, seed=3)
    found = completion_run(task, n_s, 0.5, 0.003, seed=3)
    widest = math.ceil(n_l / math.tau * task.cell) + 1
    assert expected - widest * task.beam_period <= found <= expected


def test_a_run_goes_on_only_where_cells_are_left(monkeypatch):
    completion_run.cache_clear()
    passes, rows_passed = [], timing_error.rows_passed

    def counted(task, reversals, entry, last):
        passes.append(entry.size)
        return rows_passed(task, reversals, entry, last)

    monkeypatch.setattr(timing_error, 'rows_passed', counted)
    completion_run(LOW_LAST_ROW, 4001, 0.5, 0.003, seed=3)
    assert passes[-1] <= passes[0] / 20


def test_a_run_without_error_never_completes_if_it_has_fewer_samples_than_rows():
    assert completion_run(Task(), 11, 0.5, 0.0, seed=1) == math.inf


def enumerated_run(task, n_s, error, duration, seed):
    """Return when the last cell is first hit [s]."""
    samples = int(duration / task.beam_period)
    reversals = reversal_instants(n_s, 0.5, error / task.beam_period, samples, seed)
    n = np.arange(samples)
    # From the lower limit on, by the number of the first reversal.
    sweep = np.interp(n, reversals, np.arange(len(reversals)))
    row = task.row_of_height(1.0 - np.abs(sweep % 2.0 - 1.0), 1)
    column = task.column_of_step()[n % task.steps_per_revolution]
    n, cell = n[column >= 0], (column * task.rows + row)[column >= 0]
    first = np.full(task.cells, samples)
    first[cell[::-1]] = n[::-1]
    return first.max() * task.beam_period
