"""A region is seldom a whole number of cells: what is left over must not be refused."""

import json
import math

from hypothesis import example, given
from hypothesis import strategies as st
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.commands.entry_points import plan_scan
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import pytest

CENTIMETRES = range(30, 601)


@pytest.mark.parametrize('begin', CENTIMETRES[::96])
def test_distances_have_a_nod_that_completes(begin):
    for distance in CENTIMETRES[begin - 30 : begin + 66 : 7]:
        task = Task(0.10, distance / 100.0, full_circle=True)
        n_s = quick_choice(task, samples_in_band(task)[::200])
        assert math.isfinite(Coverage(task, Pattern(1024, n_s)).completion_time()), distance


def test_plan_scan_answers_where_a_sliver_is_left_over(capsys):
    assert plan_scan(['--full-circle', '--distance', '0.59', '--timing-error', '0', '--json']) == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan['never_hit_share'] == 0.0
    assert plan['completion_time'] > plan['lower_bound'] > 0.0


@given(st.integers(1, 2000), st.floats(1e-3, 2.0))
def test_columns_are_cells_wide_but_the_last_is_less_than_a_step_wider(steps, size):
    task = Task(size, 1.0, full_circle=True, steps_per_revolution=steps)
    last = math.tau - (task.columns - 1) * task.cell
    assert -1e-6 < last < task.cell + math.tau / steps + 1e-6
    if task.cell >= math.tau / steps:
        assert set(task.column_of_step().tolist()) == set(range(task.columns))


@example(1.101, 0.0, 0.05)
@given(st.floats(0.01, 3.1), st.floats(-3.0, 3.0), st.floats(0.01, 1.5))
def test_every_column_of_a_region_in_view_has_a_beam(azimuth, centre, size):
    whole_turn = {'window_min': -math.pi, 'window_max': math.pi}
    task = Task(size, 1.0, azimuth=azimuth, centre=centre, **whole_turn)
    columns = set(task.column_of_step().tolist()) - {-1}
    assert columns == set(range(task.columns))


@given(st.floats(1e-3, 2.0), st.floats(0.1, 1.5))
def test_rows_are_cells_high_but_the_last_is_up_to_a_hundredth_higher(size, limit):
    task = Task(size, 1.0, -limit, limit)
    last = task.span - (task.rows - 1) * task.cell
    assert last < 1.01 * task.cell * (1.0 + 1e-6)
    assert task.rows == 1 or last > 0.01 * task.cell * (1.0 - 1e-6)


@pytest.mark.parametrize('steps', [360, 400, 450, 720, 1024, 1440])
@pytest.mark.parametrize('distance', [1.0, 1.5, 2.5, 4.0])
def test_a_region_all_around_that_is_no_full_circle_has_a_beam_in_every_column(steps, distance):
    """The step opposite the centre is the first one of the region, not the last."""
    around = {'azimuth': math.pi, 'window_min': -math.pi, 'window_max': math.pi}
    task = Task(0.1, distance, steps_per_revolution=steps, **around)
    assert set(task.column_of_step().tolist()) == set(range(task.columns))
