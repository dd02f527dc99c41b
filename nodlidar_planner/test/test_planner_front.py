"""The trade of time for the largest hole, against the holes of all nods after every sample."""

from itertools import pairwise
import math

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.front import Front, RUNS
from nodlidar_planner.choice.timing_error import reversal_instants
from nodlidar_planner.holes.hole import largest_hole, largest_side
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import widest_by_corners
import pytest

SMALL = 1e-7  # phases are rounded to 1e-8 of a sample, which may be 3 rad high


@st.composite
def bands(draw):
    """Return a task, some N_s and a start pitch, few enough to enumerate."""
    pitch_min = draw(st.floats(-1.5, 1.4))
    task = Task(
        pitch_min=pitch_min,
        pitch_max=draw(st.floats(pitch_min + 0.05, 1.6)),
        azimuth=draw(st.floats(0.05, math.pi)),
        full_circle=draw(st.booleans()),
        steps_per_revolution=draw(st.integers(1, 12)),
    )
    samples = draw(st.lists(st.integers(1, 9), min_size=1, max_size=4, unique=True))
    part = draw(st.none() | st.floats(0.0, 1.0))
    start = None if part is None else min(task.pitch_min + part * task.span, task.pitch_max)
    return task, np.array(samples), start


def holes_after_every_sample(task, samples, start):
    """Return the largest holes, shape (N_s, samples taken), through all of their periods."""
    phases = [
        0.5 if start is None else n_s * ((start - task.pitch_min) / task.span) for n_s in samples
    ]
    patterns = [
        Pattern(task.steps_per_revolution, int(n_s), phase)
        for n_s, phase in zip(samples, phases, strict=True)
    ]
    most = max(pattern.period for pattern in patterns)
    return np.array([holes_of(task, pattern, most) for pattern in patterns])


def holes_of(task, pattern, most):
    """Return the largest hole after each number of samples up to most; beams only make it less."""
    holes = np.empty(most + 1)
    holes[[0, most]] = [widest_by_corners(task, pattern, n) for n in (0, most)]
    between = [(0, most)]
    while between:
        begin, end = between.pop()
        if holes[begin] == holes[end] or end - begin < 2:
            holes[begin + 1 : end] = holes[end]
        else:
            middle = (begin + end) // 2
            holes[middle] = widest_by_corners(task, pattern, middle)
            between += [(begin, middle), (middle, end)]
    return holes


ALIKE_BUT_FOR_ROUNDING = (
    Task(pitch_min=0.0, pitch_max=1.0, full_circle=True, steps_per_revolution=10),
    np.array([1, 4, 7]),
    0.36685556322186513,
)


@settings(max_examples=60)
@given(bands(), st.floats(0.0, 1.0))
@example(ALIKE_BUT_FOR_ROUNDING, 0.25)
def test_a_time_gives_the_smallest_hole_and_when_it_first_is_there(band, part):
    task, samples, _ = band
    holes = holes_after_every_sample(*band)
    smallest = holes.min(axis=0)
    elapsed = max(part * (len(smallest) - 1), 0.5)  # samples, also between two of them
    taken, time = math.ceil(elapsed), elapsed * task.beam_period
    front = Front(*band)
    if smallest[taken] > largest_side(task) - SMALL:
        with pytest.raises(ParameterError, match='time_budget'):
            front.within(time)
        return
    corner = front.within(time)
    first = int(np.argmax(smallest <= smallest[taken] + SMALL))
    assert corner.hole == pytest.approx(smallest[taken], abs=SMALL)
    assert corner.time == pytest.approx(first * task.beam_period)
    nod = samples.tolist().index(corner.samples_per_sweep)
    assert holes[nod, first] == pytest.approx(smallest[taken], abs=SMALL)


@settings(max_examples=60)
@given(bands(), st.floats(0.0, 1.1))
def test_a_hole_is_reached_by_the_soonest_nod(band, part):
    task, samples, _ = band
    holes = holes_after_every_sample(*band)
    smallest = holes.min(axis=0)
    side = part * largest_side(task)
    assume(np.abs(smallest - side).min() > SMALL)
    front = Front(*band)
    if smallest[-1] > side or side > largest_side(task):
        with pytest.raises(ParameterError, match='max_hole'):
            front.reaching(side)
        return
    corner = front.reaching(side)
    first = int(np.argmax(smallest <= side))
    assert corner.time == pytest.approx(first * task.beam_period)
    assert corner.hole == pytest.approx(smallest[first], abs=SMALL)
    nod = samples.tolist().index(corner.samples_per_sweep)
    assert holes[nod, first] == pytest.approx(smallest[first], abs=SMALL)


def test_corners_of_the_reference_sensor_are_better_at_either_the_later_they_are():
    task, samples = Task(), np.arange(1001, 8000, 194)
    front = Front(task, samples)
    times = [0.5, 1.0, 2.0, 4.0, 8.0, 8.0]
    corners = front.corners(times)
    assert len(corners) > 2
    assert all(a.time < b.time and a.hole > b.hole for a, b in pairwise(corners))
    for time in times:
        hole = min(largest_hole(task, Pattern(1024, int(n), 0.5), time).side for n in samples)
        best = [corner for corner in corners if corner.time <= time][-1]
        assert best.hole == pytest.approx(hole, abs=1e-10)
        assert front.reaching(best.hole) == pytest.approx(best)


def test_under_a_timing_error_the_medians_of_all_nods_make_the_front():
    task = Task(steps_per_revolution=64, full_circle=True)
    samples, error = np.arange(41, 60, 2), 0.002
    front = Front(task, samples, timing_error=error)

    def medians(time):
        """Return the median hole of each nod, of beams at the reversals that its runs have."""
        found = []
        for n_s in samples:
            runs = [reversal_instants(n_s, 0.5, error * 640, 700, seed) for seed in RUNS]
            pattern = Pattern(64, int(n_s), 0.5)
            holes = [largest_hole(task, pattern, time, reversals).side for reversals in runs]
            found.append(sorted(holes)[len(RUNS) // 2])
        return found

    smallest = front.within(0.9)
    soonest = front.reaching(math.radians(15.0))
    assert smallest.hole == pytest.approx(min(medians(0.9)))
    assert min(medians(soonest.time)) <= math.radians(15.0) < min(medians(soonest.time - 1 / 640))
    for corner in (smallest, soonest):
        now, before = (medians(corner.time - early) for early in (0.0, 1 / 640))
        assert now[samples.tolist().index(corner.samples_per_sweep)] == corner.hole == min(now)
        assert min(before) > corner.hole


def test_what_gives_no_corner_is_refused_by_name():
    front = Front(Task(), np.array([4001, 5001]))
    for time in (0.0, -1.0, math.nan, 601.0):
        with pytest.raises(ParameterError, match="'time_budget' must be above 0 and at most 600"):
            front.within(time)
    with pytest.raises(ParameterError, match="'time_budget' must be so long that"):
        front.within(1e-3)
    assert front.corners([1e-3]) == []
    with pytest.raises(ParameterError, match=r"'max_hole' must be at least 0.3516°.*is 0.3"):
        front.reaching(math.radians(0.3))
    with pytest.raises(ParameterError, match=r'below 70.31°.*is 71'):
        front.reaching(math.radians(71.0))
    with pytest.raises(ParameterError, match='max_hole'):
        front.reaching(math.nan)


def test_a_hole_that_no_nod_gets_to_is_refused():
    # 4000 and 1024 have 32 in common: most of the region is never seen finely.
    front = Front(Task(), np.array([4000]))
    with pytest.raises(ParameterError, match='within 600 s'):
        front.reaching(math.radians(0.36))
    assert front.reaching(math.radians(4.0)).samples_per_sweep == 4000


def test_all_nods_are_gone_through_under_a_progress():
    gone = []

    def progress(patterns):
        for pattern in patterns:
            gone.append(pattern.samples_per_sweep)
            yield pattern

    Front(Task(), np.array([3001, 3003, 3005]), progress=progress).within(2.0)
    assert sorted(gone) == [3001, 3001, 3003, 3003, 3005, 3005]
