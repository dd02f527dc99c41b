from dataclasses import replace
import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.search import soonest
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.schedule import (
    even_rows,
    first_hits,
    interlaced,
    Schedule,
    shortest_interlaced,
    whole_rows,
)
import numpy as np
import pytest

SPAN = math.pi / 2
REFERENCE = Task(pitch_min=-SPAN / 2, pitch_max=SPAN / 2, full_circle=True)
SMALL = Task(
    object_size=0.5, pitch_min=-0.5, pitch_max=0.7, full_circle=True, steps_per_revolution=60
)
FAST = 1001


def completion(task, schedule, errors=0.0, horizon=60.0):
    reversals = schedule.reversals(int(horizon / task.beam_period))
    if errors > 0.0:
        noise = np.random.default_rng(7).normal(0.0, errors / task.beam_period, len(reversals))
        reversals = np.maximum.accumulate(reversals + noise) + np.arange(len(reversals)) * 1e-6
        reversals[0] = min(reversals[0], 0.0)
    return first_hits(task, reversals).max() * task.beam_period


def walked(task, reversals):
    """Return the first hits by walking from sample to sample."""
    first, sweep = {}, 0
    column_of = task.column_of_step()
    for n in range(math.ceil(reversals[-1])):
        while reversals[sweep + 1] <= n:
            sweep += 1
        part = (n - reversals[sweep]) / (reversals[sweep + 1] - reversals[sweep])
        height = (1.0 - part if sweep % 2 else part) * task.span
        row = min(int(height / task.cell + 1e-9), task.rows - 1)
        first.setdefault((int(column_of[n % task.steps_per_revolution]), row), n)
    return first


@settings(max_examples=60)
@given(
    sweeps=st.lists(st.integers(1, 200), min_size=1, max_size=3),
    returns=st.integers(1, 200),
    phase=st.sampled_from([0.25, 0.5, 0.75]),
)
def test_first_hits_are_those_of_a_walk_from_sample_to_sample(sweeps, returns, phase):
    schedule = Schedule(tuple(d for up in sweeps for d in (up, returns)), phase)
    reversals = schedule.reversals(1000)
    assert reversals[0] == -phase
    assert reversals[-2] <= 1000 < reversals[-1]
    first = first_hits(SMALL, reversals)
    expected = np.full_like(first, np.inf)
    for cell, n in walked(SMALL, reversals).items():
        expected[cell] = n
    np.testing.assert_array_equal(first, expected)


def test_a_schedule_of_equal_sweeps_is_the_steady_nod():
    first = first_hits(REFERENCE, Schedule((1077, 1077)).reversals(20 * 10_240))
    steady = Coverage(REFERENCE, Pattern(1024, 1077)).first_hits()
    assert steady.max() < NEVER
    np.testing.assert_array_equal(first, steady)


@settings(max_examples=60)
@given(
    fewest=st.integers(1, 300),
    combs=st.integers(1, 9),
    overlap=st.floats(0.0, 0.6),
)
def test_no_sweep_exceeds_the_speed_limit_and_a_period_is_whole_revolutions(
    fewest, combs, overlap
):
    schedule = interlaced(SMALL, fewest, combs, overlap)
    assert min(schedule.sweeps) >= fewest
    assert len(schedule.sweeps) == 2 * combs
    assert schedule.period % SMALL.steps_per_revolution == 0
    assert schedule == interlaced(SMALL, fewest, combs, overlap)


@pytest.mark.parametrize('combs', [1, 2, 3, 5, 8])
@pytest.mark.parametrize(('from_row', 'from_column'), [(0.0, 0.0), (0.5, 0.5), (0.3, 0.8)])
def test_wherever_the_object_lies_a_period_of_combs_finds_it(combs, from_row, from_column):
    """The cells may be shifted at will: each is hit by a slow sweep alone."""
    task = whole_rows(REFERENCE)
    schedule = interlaced(task, FAST, combs, overlap=0.05)
    reversals = schedule.reversals(schedule.period)
    n = np.arange(schedule.period)
    sweep = np.searchsorted(reversals, n, side='right') - 1
    part = (n - reversals[sweep]) / np.diff(reversals)[sweep]
    row = np.floor(part * task.rows - from_row)
    column = np.floor((n % 1024) * (math.tau / 1024) / task.cell - from_column)
    kept = (sweep % 2 == 0) & (row >= 0) & (row < task.rows - 1) & (column >= 0) & (column < 124)
    hit = set(zip(row[kept].tolist(), column[kept].tolist(), strict=True))
    assert len(hit) == (task.rows - 1) * 124


@pytest.mark.parametrize(('distance', 'share'), [(1.0, 0.96), (2.0, 0.78), (3.0, 0.36)])
def test_interlaced_sweeps_complete_sooner_than_the_best_steady_nod(distance, share):
    """At the same highest speed, slower by no more than the useful band, with overlap."""
    task = Task(distance=distance, pitch_min=-SPAN / 2, pitch_max=SPAN / 2, full_circle=True)
    steady = soonest(task, np.arange(FAST, 8001, 2))[1][0]
    wider = whole_rows(task)
    schedule = shortest_interlaced(wider, math.ceil(FAST * wider.span / SPAN), 8000, 0.05)
    assert max(schedule.sweeps) <= 8000
    assert completion(wider, schedule) <= share * steady


@pytest.mark.parametrize('error', [0.001, 0.003])
def test_overlap_takes_up_errors_of_the_turns_where_the_steady_nod_loses_much(error):
    task = whole_rows(REFERENCE)
    schedule = interlaced(task, FAST, combs=4, overlap=0.25)
    assert completion(task, schedule, error) <= 1.02 * completion(task, schedule)
    assert completion(REFERENCE, Schedule((1077, 1077)), error) > 2.0 * 6.0


def test_even_rows_fill_given_limits():
    even = even_rows(REFERENCE)
    assert (even.pitch_min, even.pitch_max) == (REFERENCE.pitch_min, REFERENCE.pitch_max)
    assert even.rows == REFERENCE.rows
    assert even.rows * even.cell == pytest.approx(even.span, rel=1e-12)
    assert even.object_size <= REFERENCE.object_size


def test_whole_rows_are_as_many_and_as_high_as_a_cell():
    wider = whole_rows(REFERENCE)
    assert wider.cells == REFERENCE.cells
    assert wider.span == pytest.approx(wider.rows * wider.cell, abs=1e-12)
    assert wider.pitch_min + wider.pitch_max == pytest.approx(0.0, abs=1e-12)
    assert whole_rows(wider).span == pytest.approx(wider.span, abs=1e-12)


@pytest.mark.parametrize('sweeps', [(), (3,), (3, 0)])
def test_a_schedule_of_no_nod_is_refused(sweeps):
    with pytest.raises(ParameterError, match='sweeps'):
        Schedule(sweeps)


def test_what_cannot_be_interlaced_is_refused():
    with pytest.raises(ParameterError, match='combs'):
        interlaced(REFERENCE, FAST, 0)
    with pytest.raises(ParameterError, match='overlap'):
        interlaced(REFERENCE, FAST, 2, 1.0)
    with pytest.raises(ParameterError, match='most_samples'):
        shortest_interlaced(REFERENCE, FAST, FAST)
    finer = replace(REFERENCE, object_size=0.001, distance=10.0)  # a search would take minutes
    with pytest.raises(ParameterError, match='most_samples'):
        shortest_interlaced(finer, FAST, FAST - 1)
