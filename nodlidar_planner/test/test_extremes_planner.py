"""The planner at the limits of what can be asked of it (docs/extremes.md)."""

from dataclasses import fields
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import limits_of
from nodlidar_planner.choice.choice import plans
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import evaluate
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import MAX_SAMPLES_PER_SWEEP, Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import enumerate_cells
import pytest

EDGES = [
    (field.name, edge)
    for field in fields(Task)
    for edge in (limits_of(field).minimum, limits_of(field).maximum)
    if edge is not None
]
# What goes with an edge, for the task to make sense and its cells to be few enough to enumerate.
WITH = {
    ('object_size', 1e-6): {'distance': 1e-3},
    ('object_size', 1e3): {'distance': 1e6},
    ('distance', 1e-3): {'object_size': 2e-3},
    ('distance', 1e6): {'object_size': 1e3},
    ('pitch_min', 1.6): {'pitch_min': math.nextafter(1.6, 0.0), 'pitch_max': 1.6},
    ('pitch_max', -1.6): {'pitch_min': -1.6, 'pitch_max': math.nextafter(-1.6, 0.0)},
    ('window_min', math.tau): {'window_max': 8.0, 'centre': 0.8, 'azimuth': 0.7},
    ('window_max', -math.tau): {'window_min': -math.tau, 'azimuth': 0.01},  # one beam, ahead
}
# Limits at which columns have no beam (681 steps are in the region), or too many N_s are in the
# band; and what is said.
UNSEEN = 'such that each of the {} columns has a beam, not only {}'
SMALL = 'at least {} m, a step of the lidar at {} m'
IMPOSSIBLE = {
    ('object_size', 1e-6): ('object_size', SMALL.format('6.136e-06', '0.001')),
    ('object_size', 1e3): ('object_size', SMALL.format(6136, '1e+06')),
    ('distance', 1e6): ('object_size', SMALL.format(6136, '1e+06')),
    ('azimuth', math.pi): ('azimuth', UNSEEN.format(126, 84)),
    ('centre', math.pi): ('azimuth', UNSEEN.format(84, 43)),
    ('centre', -math.pi): ('azimuth', UNSEEN.format(84, 43)),
    ('steps_per_revolution', 1): ('object_size', SMALL.format(4, 2)),
    ('steps_per_revolution', 65_536): (
        'speed_min',
        'at least 3.046 rad/s, for 200000 choices',
    ),
    # A sweep of a useful duration has a dozen beams, or millions.
    ('scan_rate', 0.01): ('object_size', 'so large that some N_s hits every row'),
    ('scan_rate', 2000.0): ('speed_min', 'at least 6.281 rad/s, for 200000 choices'),
}


def task_at(key, edge):
    return Task(**({key: edge} | WITH.get((key, edge), {})))


@pytest.mark.parametrize(('key', 'edge'), EDGES)
@pytest.mark.parametrize('n_s', [1, 33])
def test_at_every_limit_of_a_task_the_figures_are_those_of_enumeration(key, edge, n_s):
    task = task_at(key, edge)
    pattern = Pattern(task.steps_per_revolution, n_s)
    figures, expected = Coverage(task, pattern).figures(), enumerate_cells(task, pattern)
    last = expected.first.max()
    completion = math.inf if last == NEVER else last * task.beam_period
    assert figures.completion_time == pytest.approx(completion)
    assert figures.cells == expected.first.size
    assert figures.never_hit_share == pytest.approx(np.mean(expected.first == NEVER))
    period = np.lcm(task.steps_per_revolution, 2 * n_s) * task.beam_period
    assert figures.hit_frequency == pytest.approx(np.mean(expected.crossings) / period)


@pytest.mark.parametrize(('key', 'edge'), [edge for edge in EDGES if edge not in IMPOSSIBLE])
def test_at_a_limit_of_a_task_that_can_be_done_the_choice_is_a_plan(key, edge):
    task = task_at(key, edge)
    (plan,) = plans(task, samples_in_band(task)[::40], Objective(), count=1)
    assert plan.lower_bound <= plan.figures.completion_time < math.inf
    assert math.gcd(plan.samples_per_sweep, task.steps_per_revolution) == 1
    assert 0.0 < plan.hole < math.tau


@pytest.mark.parametrize(('key', 'edge'), IMPOSSIBLE)
def test_an_impossible_task_at_a_limit_is_refused_with_the_reason(key, edge):
    task = task_at(key, edge)
    with pytest.raises(ParameterError) as caught:
        plans(task, samples_in_band(task), Objective(), count=1)
    assert (caught.value.key, caught.value.limit) == IMPOSSIBLE[key, edge]


@pytest.mark.parametrize(('key', 'edge'), EDGES)
def test_beyond_every_limit_of_a_task_is_refused_by_name(key, edge):
    toward = math.inf if edge == max(e for k, e in EDGES if k == key) else -math.inf
    beyond = math.nextafter(edge, toward)
    if isinstance(edge, int):
        beyond = edge + (1 if toward > 0.0 else -1)
    for value in (beyond, math.nan, toward):
        with pytest.raises(ParameterError, match=f"'{key}' must be ") as caught:
            Task(**{key: value})
        assert caught.value.key == key


@pytest.mark.parametrize('span', [5e-324, 1e-300, 1e-12, 1e-6])
@pytest.mark.parametrize('n_s', [1, 1001, MAX_SAMPLES_PER_SWEEP])
def test_a_nod_of_hardly_any_span_sees_its_one_row_of_cells_in_every_revolution(span, n_s):
    task = Task(pitch_min=0.0, pitch_max=span)
    plan = evaluate(task, n_s)
    # The 84th of the columns, 0.05 rad wide, from azimuth -119.53 degrees on.
    last_column = math.ceil((83 * task.cell - task.azimuth + 0.75 * math.pi) / (math.tau / 1024))
    assert plan.figures.completion_time == pytest.approx(last_column * task.beam_period)
    assert plan.figures.cells == 84
    assert plan.figures.revisit_max == pytest.approx(0.1)
    assert plan.figures.hit_frequency == pytest.approx(10.0)
    assert plan.hole == pytest.approx(span)


@pytest.mark.parametrize('n_l', [1, 2, 65_536])
@pytest.mark.parametrize('n_s', [1, 7, MAX_SAMPLES_PER_SWEEP])
def test_the_fewest_and_the_most_samples_and_steps_see_as_many_cells_as_they_can(n_l, n_s):
    """The steps see min(N_L, columns) columns, the heights of their samples so many rows."""
    task = Task(steps_per_revolution=n_l, full_circle=True)
    figures = evaluate(task, n_s).figures
    assert figures.cells == 126 * 25
    heights = {1: 1, 7: 7, MAX_SAMPLES_PER_SWEEP: 25}[n_s]
    seen = min(n_l, 126) * heights
    assert figures.never_hit_share == pytest.approx(1.0 - seen / figures.cells)
    complete = seen == figures.cells
    assert math.isfinite(figures.completion_time) == complete
    assert math.isfinite(figures.revisit_max) == complete
