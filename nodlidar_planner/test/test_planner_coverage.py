"""Coverage against plain enumeration, equal to the last hit; and its extremes."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import cells_of_samples, enumerate_cells
import pytest


def task_with_cell(cell, **others):
    """Return a task whose cells have this side [rad]."""
    return Task(object_size=2.0 * math.sin(cell / 2.0), distance=1.0, **others)


def assert_same_hits(task, first, expected):
    """Compare the columns that are seen; cells that are finer than samples by their hits alone."""
    seen = np.unique(task.column_of_step())
    expected = expected[seen[seen >= 0]]
    if first.shape == expected.shape:
        assert np.array_equal(first, expected)
    else:
        assert len(first) == len(expected)
        assert np.array_equal(np.sort(first[first != NEVER]), np.sort(expected[expected != NEVER]))


def check_equal(task, pattern):
    coverage, expected = Coverage(task, pattern), enumerate_cells(task, pattern)
    figures = coverage.figures()
    hit = expected.first != NEVER
    assert_same_hits(task, coverage.first_hits(), expected.first)
    time = task.beam_period
    assert figures.cells == task.cells
    assert figures.never_hit_share == pytest.approx(np.mean(~hit), abs=1e-12)
    period = pattern.period
    frequency = expected.crossings.sum() / (task.cells * period * time)
    assert figures.hit_frequency == pytest.approx(frequency, rel=1e-12)
    if hit.all():
        assert figures.completion_time == pytest.approx(expected.first.max() * time, rel=1e-12)
        assert figures.revisit_max == pytest.approx(expected.longest_gap.max() * time, rel=1e-12)
        assert figures.revisit_mean == pytest.approx(expected.longest_gap.mean() * time, rel=1e-9)
    else:
        assert figures.completion_time == figures.revisit_max == figures.revisit_mean == math.inf


@st.composite
def cases(draw):
    n_l, n_s = draw(st.integers(1, 64)), draw(st.integers(1, 64))
    task = task_with_cell(
        draw(st.floats(0.03, 3.0)),
        pitch_min=draw(st.floats(-1.0, 0.0)),
        pitch_max=draw(st.floats(0.05, 1.0)),
        azimuth=draw(st.floats(0.1, math.pi)),
        full_circle=draw(st.booleans()),
        steps_per_revolution=n_l,
    )
    return task, Pattern(n_l, n_s, draw(st.integers(0, 8 * n_s - 1)) / 4)


@settings(max_examples=600)
@given(cases())
def test_small_cases_equal_enumeration(case):
    check_equal(*case)


@pytest.mark.parametrize('n_l', [1, 8])
def test_all_phases_and_sweeps_of_a_lidar_equal_enumeration(n_l):
    task = task_with_cell(0.35, full_circle=True, steps_per_revolution=n_l)
    for n_s in range(1, 17):
        for quarter in range(8 * n_s):
            check_equal(task, Pattern(n_l, n_s, quarter / 4))


FULL_SIZE = [
    # object, distance, span, full circle, N_L, N_s, phase
    (0.10, 2.0, math.pi / 2, True, 1024, 2745, 0.0),
    (0.10, 2.0, math.pi / 2, True, 1024, 1057, 0.0),
    (0.10, 2.0, math.pi / 2, True, 1024, 1077, 0.5),
    (0.10, 2.0, math.pi / 2, True, 1024, 4001, 0.5),
    (0.10, 2.0, math.pi / 2, True, 1024, 7987, 1234.25),
    (0.10, 2.0, math.pi / 2, True, 1024, 4000, 0.5),
    (0.10, 1.0, math.pi / 2, True, 1024, 4007, 0.0),
    (0.10, 3.0, math.pi / 2, True, 1024, 1169, 0.0),
    (0.05, 3.0, math.pi / 2, True, 1024, 3001, 0.5),
    (0.10, 2.0, 1.2272, False, 1024, 4001, 0.5),
    (0.10, 2.0, 1.2272, False, 1024, 3009, 17.75),
    (0.10, 2.0, 1.2272, False, 1024, 6006, 0.5),
    (0.30, 2.0, 0.4, False, 1024, 1605, 0.5),
    (0.02, 4.0, 0.2, False, 1024, 2001, 0.5),
    (0.10, 2.0, 1.2272, True, 1440, 2747, 0.5),
    (0.10, 2.0, 1.2272, True, 1440, 2746, 0.25),
    (0.10, 2.0, 1.2272, True, 360, 1001, 0.5),
    (0.10, 2.0, 1.2272, True, 400, 1999, 3997.75),
    (1.90, 1.0, 1.2272, True, 1024, 1001, 0.5),
    (0.10, 2.0, 1.2272, True, 1025, 2048, 0.25),
]


@pytest.mark.parametrize(('size', 'distance', 'span', 'circle', 'n_l', 'n_s', 'phase'), FULL_SIZE)
def test_full_size_cases_equal_enumeration(size, distance, span, circle, n_l, n_s, phase):
    task = Task(size, distance, -span / 2, span / 2, full_circle=circle, steps_per_revolution=n_l)
    check_equal(task, Pattern(n_l, n_s, phase))


@settings(max_examples=200)
@given(cases(), st.integers(0, 10**12))
def test_the_first_hits_from_any_sample_equal_enumeration(case, start):
    task, pattern = case
    cell = cells_of_samples(task, pattern, start + np.arange(pattern.period))
    expected = np.full(task.cells, NEVER)
    hits = np.flatnonzero(cell >= 0)
    expected[cell[hits][::-1]] = hits[::-1]
    expected = expected.reshape(task.columns, task.rows)
    first = Coverage(task, pattern).first_hits(start)
    assert_same_hits(task, first, expected.reshape(task.columns, task.rows))


@pytest.mark.parametrize(
    ('n_s', 'distance', 'completion'),
    [(2745, 2.0, 13.1), (1057, 2.0, 6.3), (4001, 2.0, 12.1), (7987, 2.0, 7.0), (1169, 3.0, 25.7)],
)
def test_the_completion_times_that_were_published_or_enumerated_before(n_s, distance, completion):
    task = Task(0.10, distance, -math.pi / 4, math.pi / 4, full_circle=True)
    assert Coverage(task, Pattern(1024, n_s, 0.0)).completion_time() == pytest.approx(
        completion, abs=0.05
    )


@settings(max_examples=100)
@given(cases(), st.floats(0.0, 20.0))
def test_hits_with_a_margin_stay_hits(case, margin):
    task, pattern = case
    careful, free = Coverage(task, pattern, margin), Coverage(task, pattern)
    if task.rows <= pattern.cycle:
        assert np.all(careful.first_hits() >= free.first_hits())


def test_a_divisor_leaves_a_reported_share_of_the_cells_out():
    task = task_with_cell(0.01, full_circle=True)
    figures = Coverage(task, Pattern(1024, 1024)).figures()
    expected = enumerate_cells(task, Pattern(1024, 1024))
    assert figures.completion_time == math.inf
    assert figures.never_hit_share == pytest.approx(np.mean(expected.first == NEVER))
    assert 0.9 < figures.never_hit_share < 1.0


@pytest.mark.parametrize('n_l', [1, 360, 1440, 16384])
@pytest.mark.parametrize('n_s', [1, 2, 360, 1024, 16384])
@pytest.mark.parametrize('cell', [1e-3, 0.05, 3.0])
def test_extremes_end_in_an_answer(n_l, n_s, cell):
    task = task_with_cell(cell, full_circle=True, steps_per_revolution=n_l)
    figures = Coverage(task, Pattern(n_l, n_s, 2 * n_s - 0.25)).figures()
    assert not math.isnan(figures.completion_time + figures.revisit_max + figures.revisit_mean)
    assert 0.0 <= figures.never_hit_share <= 1.0
    assert (figures.completion_time == math.inf) == (figures.never_hit_share > 0.0)


def test_what_does_not_fit_the_memory_is_refused():
    with pytest.raises(ParameterError, match='samples_per_sweep'):
        Coverage(Task(), Pattern(1024, 10_000_000))
    with pytest.raises(ParameterError, match='object_size'):
        Coverage(
            task_with_cell(4e-4, full_circle=True, steps_per_revolution=16384),
            Pattern(16384, 4001),
        ).figures()
    with pytest.raises(ParameterError, match='steps_per_revolution'):
        Coverage(Task(), Pattern(1000, 4001))


@pytest.mark.parametrize(('begin', 'end', 'column'), [(-0.6, 1.0, 1), (-1.0, 0.6, 0)])
def test_the_beam_opposite_the_centre_is_beside_its_neighbour(begin, end, column):
    task = task_with_cell(
        math.pi,
        azimuth=math.pi,
        steps_per_revolution=40,
        window_min=begin * math.pi,
        window_max=end * math.pi,
    )
    assert task.column_of_step()[35] == column  # 35 steps of 9 degrees after -135 degrees
    check_equal(task, Pattern(40, 6, 4.25))


def test_a_column_on_both_sides_of_a_gap_is_refused():
    task = task_with_cell(1.0, azimuth=math.pi, window_min=-2.2, window_max=math.tau - 2.5)
    with pytest.raises(ParameterError, match='azimuth'):
        Coverage(task, Pattern(1024, 4001))
