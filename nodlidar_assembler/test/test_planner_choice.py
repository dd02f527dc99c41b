"""The choice of N_s against going through all of them, and under errors of the servo's turns."""

import math
import time

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.planner.choice import (
    evaluate,
    lower_bound,
    Objective,
    plans,
    quick_choice,
    samples_in_band,
    survey,
)
from nodlidar_assembler.planner.coverage import column_runs, Coverage, NEVER
from nodlidar_assembler.planner.pattern import Pattern
from nodlidar_assembler.planner.search import column_completion, phase_at, soonest
from nodlidar_assembler.planner.task import Task
from nodlidar_assembler.planner.timing_error import completion_run, turn_instants
from nodlidar_common.errors import ParameterError
import numpy as np
from planner_enumeration import enumerate_cells
import pytest

PUBLISHED = Task(0.10, 2.0, -math.pi / 4, math.pi / 4, full_circle=True)
BAND = samples_in_band(PUBLISHED)


def completions(task, samples, guard=0.0, start_pitch=None):
    phases = phase_at(task, samples, start_pitch)
    return np.array(
        [
            Coverage(task, Pattern(task.steps_per_revolution, n_s, phase), guard).completion_time()
            for n_s, phase in zip(samples.tolist(), phases.tolist(), strict=True)
        ]
    )


def test_the_band_is_all_odd_samples_of_the_useful_band():
    assert np.array_equal(BAND, np.arange(1001, 8000, 2))


def test_speeds_bound_the_band():
    samples = samples_in_band(Task(), speed_min=2.0, speed_max=3.0)
    speeds = [Task().speed(n_s) for n_s in (samples[0], samples[-1])]
    assert speeds == pytest.approx([3.0, 2.0], rel=1e-3)
    assert speeds[0] <= 3.0
    assert speeds[1] >= 2.0
    assert np.all(np.gcd(samples, 1024) == 1)


@pytest.mark.parametrize(
    ('speeds', 'key'),
    [((3.0, 2.0), 'speed_max'), ((0.0, 1.0), 'speed_min'), ((math.nan, 1.0), 'speed_min'),
     ((None, math.inf), 'speed_max'), ((1e-9, 1.0), 'speed_min')],
)  # fmt: skip
def test_speeds_that_are_none_are_refused(speeds, key):
    with pytest.raises(ParameterError, match=key):
        samples_in_band(Task(), *speeds)


def test_the_choice_completes_in_less_than_half_the_time_of_the_published_one():
    best = plans(PUBLISHED, BAND, Objective(), count=1)[0]
    published = evaluate(PUBLISHED, 2745, start_pitch=PUBLISHED.pitch_min)
    assert best.figures.completion_time <= 6.3
    assert published.figures.completion_time == pytest.approx(13.13, abs=0.005)
    assert best.lower_bound < best.figures.completion_time


def test_the_choice_is_the_best_of_all_and_much_quicker_than_going_through_all():
    start = time.perf_counter()
    found, times = soonest(PUBLISHED, BAND, count=5)
    middle = time.perf_counter()
    expected = completions(PUBLISHED, BAND)
    ratio = (time.perf_counter() - middle) / (middle - start)
    order = np.argsort(expected, kind='stable')[:5]
    assert np.array_equal(found, BAND[order])
    assert np.array_equal(times, expected[order])
    assert ratio > 3.0


@pytest.mark.parametrize('guard', [0.0, 6.0])
@pytest.mark.parametrize('start_pitch', [None, 0.2])
@pytest.mark.parametrize(
    'task',
    [
        Task(),
        Task(distance=3.0),
        Task(0.3, 1.0, -0.3, 0.5, full_circle=True, steps_per_revolution=400),
        Task(0.02, 1.0, 0.1, 0.3),
        Task(0.02, 1.0, -0.8, 0.8, azimuth=0.2, steps_per_revolution=1440),
    ],
)
def test_the_soonest_of_a_band_equal_those_of_all(task, start_pitch, guard):
    samples = samples_in_band(task)[::23]
    expected = completions(task, samples, guard, start_pitch)
    found, times = soonest(task, samples, guard, 3, start_pitch)
    best = np.sort(expected)[:3]
    assert np.array_equal(times, best[np.isfinite(best)])
    assert np.array_equal(times, [expected[samples == n_s][0] for n_s in found])


@settings(max_examples=150, deadline=None)
@given(
    st.integers(2, 64),
    st.integers(1, 80),
    st.floats(0.05, 1.5),
    st.floats(0.0, 3.0),
    st.integers(0, 10**6),
)
def test_no_column_completes_before_its_bound(n_l, n_s, cell, guard, which):
    task = Task(2 * math.sin(cell / 2), 1.0, full_circle=True, steps_per_revolution=n_l)
    starts, widths = column_runs(task.column_of_step())
    column = which % len(starts)
    bound = column_completion(
        task, np.array([n_s]), int(starts[column]), int(widths[column]), 4 * n_l, guard
    )
    first = Coverage(task, Pattern(n_l, n_s), guard).first_hits()[column]
    horizon = 4 * n_l * n_l
    if task.rows <= 2 * n_s and first.max(initial=0) < horizon:
        assert bound[0] <= first.max(initial=0) * task.sample_time + 1e-9


@settings(max_examples=200, deadline=None)
@given(
    st.integers(1, 64),
    st.integers(1, 64),
    st.floats(0.1, 2.0),
    st.booleans(),
    st.integers(0, 7),
    st.floats(0.3, 3.0),
)
def test_nothing_completes_before_the_lower_bound(n_l, n_s, cell, circle, quarters, azimuth):
    task = Task(
        2 * math.sin(cell / 2), 1.0, azimuth=azimuth, full_circle=circle, steps_per_revolution=n_l
    )
    pattern = Pattern(n_l, n_s, (quarters % (8 * n_s)) / 4)
    last = enumerate_cells(task, pattern).first.max()
    completion = last * task.sample_time if last != NEVER else math.inf
    assert lower_bound(task, n_s) <= completion + 1e-12


def test_the_lower_bound_is_near_one_row_per_revolution():
    assert 2.9 < lower_bound(PUBLISHED, 4001) < 3.2
    assert lower_bound(PUBLISHED, 1001) < lower_bound(PUBLISHED, 8000)
    assert lower_bound(Task(azimuth=math.pi), 1001) == math.inf


def test_weights_choose_by_what_they_weigh():
    task, samples = Task(0.4, 2.0), BAND[::50]
    figures = survey(task, samples)
    by_revisit = plans(task, samples, Objective(completion=0.0, revisit=1.0), count=2)
    assert by_revisit[0].figures.revisit_max == min(f.revisit_max for f in figures)
    by_hole = plans(task, samples, Objective(completion=0.0, hole=1.0, hole_after=2.0), count=99)
    holes = [plan.hole for plan in by_hole]
    assert holes == sorted(holes)
    assert len(holes) == len(samples)


def test_survey_shows_what_it_goes_through():
    shown = []
    assert (
        len(survey(Task(), BAND[:3], progress=lambda samples: shown.extend(samples) or shown)) == 3
    )
    assert shown == [1001, 1003, 1005]


def test_a_run_without_error_takes_as_long_as_coverage_says():
    for task in (PUBLISHED, Task(), Task(distance=1.0, steps_per_revolution=1440)):
        for n_s in (1001, 2747, 4001, 7999):
            exact = Coverage(task, Pattern(task.steps_per_revolution, n_s)).completion_time()
            run = completion_run(task, n_s, 0.5, 0.0, seed=1)
            assert exact - 10 * task.sample_time <= run <= exact + 1e-12


@pytest.mark.parametrize('n_s', [1057, 4001, 7987])
@pytest.mark.parametrize('error', [0.001, 0.008])
def test_a_run_takes_as_long_as_its_samples_enumerated(n_s, error):
    task, samples = PUBLISHED, int(60.0 / PUBLISHED.sample_time)
    turns = turn_instants(n_s, 0.5, error / task.sample_time, samples, seed=7)
    n = np.arange(samples)
    sweep = np.interp(n, turns, np.arange(len(turns)))
    row = task.row_of_height(1.0 - np.abs(sweep % 2.0 - 1.0), 1)
    cell = task.column_of_step()[n % 1024] * task.rows + row
    first = np.full(task.cells, samples)
    first[cell[::-1]] = n[::-1]
    expected = first.max() * task.sample_time
    assert completion_run(task, n_s, 0.5, error, seed=7) == pytest.approx(expected, abs=0.001)


def test_the_timing_errors_that_were_measured_before():
    median = evaluate(PUBLISHED, 2745, PUBLISHED.pitch_min, 0.003).under_error.median
    assert median == pytest.approx(22.0, abs=2.5)
    median = evaluate(PUBLISHED, 1057, PUBLISHED.pitch_min, 0.001).under_error.median
    assert median == pytest.approx(17.9, abs=2.5)


def test_the_robust_choice_completes_sooner_than_the_nominal_one_under_error():
    error, fresh = 0.003, range(5000, 5100)
    nominal = plans(PUBLISHED, BAND, Objective(), count=1)[0]
    robust = plans(PUBLISHED, BAND, Objective(), timing_error=error, count=1)[0]
    quick = quick_choice(PUBLISHED, BAND, error)
    medians = [
        np.median([completion_run(PUBLISHED, n_s, 0.5, error, seed) for seed in fresh])
        for n_s in (nominal.samples_per_sweep, robust.samples_per_sweep, quick)
    ]
    assert medians[0] >= 1.5 * medians[1]
    assert medians[0] >= 1.5 * medians[2]
    assert robust.figures.completion_time > nominal.figures.completion_time


def test_without_error_the_quick_choice_is_the_exact_one():
    assert (
        quick_choice(PUBLISHED, BAND) == plans(PUBLISHED, BAND, Objective())[0].samples_per_sweep
    )


def test_an_error_wider_than_the_rows_still_ends_in_a_choice():
    task = Task(0.02, 2.0)
    assert quick_choice(task, samples_in_band(task)[::40], timing_error=0.05) in BAND


def test_what_never_completes_is_refused_by_name():
    with pytest.raises(ParameterError, match="'object_size' must be such that each of the"):
        plans(Task(0.001, 5.0), BAND, Objective())
    with pytest.raises(ParameterError, match="'object_size' must be so large that with some N_s"):
        plans(Task(0.02, 2.0), np.array([17]), Objective())
    with pytest.raises(ParameterError, match="'azimuth' must be such that each of the"):
        plans(Task(azimuth=3.0), BAND, Objective())
    with pytest.raises(ParameterError, match='timing_error'):
        plans(Task(), BAND, Objective(revisit=1.0), timing_error=0.001)
    with pytest.raises(ParameterError, match='start_pitch'):
        evaluate(Task(), 4001, start_pitch=1.0)


@pytest.mark.parametrize(
    'weights', [{'completion': -1.0}, {'completion': 0.0}, {'hole': math.nan}, {'hole_after': 0.0}]
)
def test_objectives_that_are_none_are_refused(weights):
    with pytest.raises(ParameterError):
        Objective(**weights)


def test_a_pattern_that_leaves_cells_out_is_evaluated_all_the_same():
    plan = evaluate(PUBLISHED, 1024)
    assert plan.figures.completion_time == math.inf
    assert 0.0 < plan.figures.never_hit_share < 1.0
    assert plan.distinct_directions == Pattern(1024, 1024).distinct_directions
