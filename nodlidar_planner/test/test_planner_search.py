"""The search for the soonest N_s against going through all of them."""

import math
import time

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_planner.choice.search import column_completion, soonest
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np
from planner_enumeration import PUBLISHED
import pytest

BAND = samples_in_band(PUBLISHED)


def completions(task, samples, margin=0.0, start_pitch=None):
    patterns = (pattern_from(task, n_s, start_pitch) for n_s in samples.tolist())
    return np.array([Coverage(task, pattern, margin).completion_time() for pattern in patterns])


def test_the_choice_is_the_best_of_all_and_much_quicker_than_going_through_all():
    start = time.thread_time()
    found, times = soonest(PUBLISHED, BAND, count=5)
    middle = time.thread_time()
    expected = completions(PUBLISHED, BAND)
    ratio = (time.thread_time() - middle) / (middle - start)
    order = np.argsort(expected, kind='stable')[:5]
    assert np.array_equal(found, BAND[order])
    assert np.array_equal(times, expected[order])
    assert ratio > 3.0


@pytest.mark.parametrize('margin', [0.0, 6.0])
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
def test_the_soonest_of_a_band_equal_those_of_all(task, start_pitch, margin):
    samples = samples_in_band(task)[::23]
    expected = completions(task, samples, margin, start_pitch)
    found, times = soonest(task, samples, margin, 3, start_pitch)
    best = np.sort(expected)[:3]
    assert np.array_equal(times, best[np.isfinite(best)])
    assert np.array_equal(times, [expected[samples == n_s][0] for n_s in found])


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
    starts, widths = column_runs(task.column_of_step())
    column = which % len(starts)
    bound = column_completion(
        task, np.array([n_s]), int(starts[column]), int(widths[column]), 4 * n_l, margin
    )
    first = Coverage(task, Pattern(n_l, n_s), margin).first_hits()[column]
    horizon = 4 * n_l * n_l
    if task.rows <= 2 * n_s and first.max(initial=0) < horizon:
        assert bound[0] <= first.max(initial=0) * task.beam_period + 1e-9
