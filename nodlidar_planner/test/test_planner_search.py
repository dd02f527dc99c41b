"""The search for the soonest N_s against going through all of them."""

from dataclasses import replace
import math
import time

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_planner.choice import search
from nodlidar_planner.choice.search import column_completion, soonest
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np
from planner_enumeration import enumerate_cells, PUBLISHED
import pytest

BAND = samples_in_band(PUBLISHED)
# Step 0 is in the region: the lidar begins within a column.
STEP_0_AHEAD = Task(
    0.5,
    1.0,
    azimuth=1.249,
    steps_per_revolution=360,
    window_min=-math.pi,
    window_max=math.pi,
    azimuth_of_step_0=0.0,
)


def completions(task, samples, margin=0.0, start_pitch=None):
    patterns = (pattern_from(task, n_s, start_pitch) for n_s in samples.tolist())
    return np.array([Coverage(task, pattern, margin).completion_time() for pattern in patterns])


def test_the_choice_is_the_best_of_all_and_much_quicker_than_going_through_all():
    band = BAND[::9]
    start = time.thread_time()
    found, times = soonest(PUBLISHED, band, count=5)
    middle = time.thread_time()
    expected = completions(PUBLISHED, band)
    ratio = (time.thread_time() - middle) / (middle - start)
    order = np.argsort(expected, kind='stable')[:5]
    assert np.array_equal(found, band[order])
    assert np.array_equal(times, expected[order])
    assert ratio > 3.0


@pytest.mark.parametrize(('start_pitch', 'margin'), [(None, 0.0), (0.2, 6.0)])
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
def test_the_soonest_of_a_band_equal_those_of_all(task, start_pitch, margin):
    samples = samples_in_band(task)[::23]
    expected = completions(task, samples, margin, start_pitch)
    found, times = soonest(task, samples, margin, 3, start_pitch)
    best = np.sort(expected)[:3]
    assert np.array_equal(times, best[np.isfinite(best)])
    assert np.array_equal(times, [expected[samples == n_s][0] for n_s in found])


def test_the_soonest_is_found_where_the_lidar_begins_within_the_region():
    samples = samples_in_band(STEP_0_AHEAD)
    first = {n_s: enumerate_cells(STEP_0_AHEAD, Pattern(360, n_s)).first for n_s in (793, 883)}
    assert first[793].max() < first[883].max()
    _, times = soonest(STEP_0_AHEAD, samples)
    assert times[0] == pytest.approx(first[793].max() * STEP_0_AHEAD.beam_period)
    assert times[0] == completions(STEP_0_AHEAD, samples).min()


def test_few_are_evaluated_where_all_tie(monkeypatch):
    task, evaluated = Task(pitch_max=-0.6135), []
    monkeypatch.setattr(
        search, 'Coverage', lambda *args: evaluated.append(args) or Coverage(*args)
    )
    found, times = soonest(task, np.arange(1001, 3001, 2))
    # With a single row, the last column's first step in the region is the last cell's first hit.
    column = task.column_of_step()
    expected = np.flatnonzero(column == column.max())[0] * task.beam_period
    assert len(found) >= 100
    assert len(evaluated) < 150
    assert np.all(times == pytest.approx(expected))


def a_column_and_its_bound(task, n_s, which, margin):
    """Return the number of a seen column, and the bound of its completion [s]."""
    starts, widths = column_runs(task.column_of_step())
    run = which % len(starts)
    bound = column_completion(
        task,
        np.array([n_s]),
        int(starts[run]),
        int(widths[run]),
        4 * task.steps_per_revolution,
        margin,
    )
    return run, bound[0]


@settings(max_examples=150)
@given(
    st.integers(2, 64),
    st.integers(1, 80),
    st.floats(0.05, 1.5),
    st.floats(0.0, 3.0),
    st.integers(0, 10**6),
)
def test_no_column_completes_before_its_bound(n_l, n_s, cell, margin, which):
    task = Task(2 * math.sin(cell / 2), 1.0, full_circle=True, steps_per_revolution=n_l)
    column, bound = a_column_and_its_bound(task, n_s, which, margin)
    first = Coverage(task, Pattern(n_l, n_s), margin).first_hits()[column]
    horizon = 4 * n_l * n_l
    if task.rows <= 2 * n_s and first.max(initial=0) < horizon:
        assert bound <= first.max(initial=0) * task.beam_period + 1e-9


@settings(max_examples=300)
@given(
    st.integers(4, 64),
    st.integers(8, 80),
    st.floats(0.2, 1.5),
    st.floats(0.3, 3.0),
    st.integers(0, 10**6),
)
def test_no_column_completes_before_its_bound_with_step_0_ahead(n_l, n_s, cell, azimuth, which):
    task = replace(
        STEP_0_AHEAD,
        object_size=2 * math.sin(cell / 2),
        azimuth=azimuth,
        steps_per_revolution=n_l,
    )
    run, bound = a_column_and_its_bound(task, n_s, which, margin=0.0)
    column = task.column_of_step()[column_runs(task.column_of_step())[0][run]]
    last = enumerate_cells(task, Pattern(n_l, n_s)).first[column].max()
    if last < 4 * n_l * n_l:
        assert bound <= last * task.beam_period + 1e-9
