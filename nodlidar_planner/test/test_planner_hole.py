"""The largest hole against plain enumeration of samples and of the corners of empty squares."""

import math

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.timing_error import reversal_instants
from nodlidar_planner.holes.hole import exceeds, largest_hole, largest_side, least_side
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import MEASURED_FROM, Task, wrapped
import numpy as np
from planner_enumeration import azimuths, beams, region, unrolled, widest_at, widest_by_corners
import pytest


def widest_by_windows(task, pattern, samples):
    """Widen a window from each line by one line at a time, and sort its beams each time."""
    azimuth, pitch = unrolled(task, *beams(task, pattern, samples))
    left, right = region(task)
    edges, line = np.unique(np.round(azimuth, 9), return_inverse=True)
    lines = np.split(pitch[np.argsort(line, kind='stable')], np.cumsum(np.bincount(line))[:-1])
    lines = [[], *lines, []]
    edges = np.concatenate([[left], edges, [right + math.tau * task.full_circle]])
    widest = 0.0
    for first in range(len(edges) - 1):
        within = np.array([task.pitch_min, task.pitch_max])
        for last in range(first + 1, len(edges)):
            gap = np.diff(within).max()
            widest = max(widest, min(edges[last] - edges[first], gap))
            if gap <= max(widest, edges[last] - edges[first]):
                break
            within = np.sort(np.concatenate([within, lines[last]]), kind='stable')
    return widest


def assert_empty(task, pattern, samples, hole):
    """No beam is within the hole, and it is within the region."""
    azimuth, pitch = beams(task, pattern, samples)
    off = azimuth - hole.azimuth
    if task.full_circle:
        off = (off + math.pi) % math.tau - math.pi
    half = hole.side / 2.0 - 1e-9
    assert not np.any((np.abs(off) < half) & (np.abs(pitch - hole.pitch) < half))
    assert task.pitch_min <= hole.pitch - half
    assert hole.pitch + half <= task.pitch_max
    assert -math.pi <= hole.azimuth < math.pi
    from_centre = (hole.azimuth - task.centre + math.pi) % math.tau - math.pi
    assert task.full_circle or abs(from_centre) + half <= task.azimuth


@given(st.floats(-20.0, 20.0))
@example(float(np.nextafter(-math.pi, -4.0)))
def test_an_azimuth_is_wrapped_to_the_same_direction_below_pi(azimuth):
    found = wrapped(azimuth)
    assert -math.pi <= found < math.pi
    assert math.cos(found - azimuth) == pytest.approx(1.0)


@st.composite
def lidars(draw):
    """Return another window than that of the URG-04LX, and a region wherever it may be."""
    ahead = st.floats(-math.pi, math.pi)
    first = draw(ahead)
    return {
        'window_min': first,
        'window_max': first + draw(st.floats(0.0, math.tau)),
        'azimuth_of_step_0': draw(ahead),
        'centre': draw(ahead),
    }


@st.composite
def cases(draw, most=24):
    n_l, n_s = draw(st.integers(1, most)), draw(st.integers(1, most))
    pattern = Pattern(n_l, n_s, draw(st.integers(0, 8 * n_s - 1)) / 4)
    pitch_min = draw(st.floats(-1.5, 1.4))
    task = Task(
        pitch_min=pitch_min,
        pitch_max=draw(st.floats(pitch_min + 0.05, 1.6)),
        azimuth=draw(st.floats(0.05, math.pi)),
        full_circle=draw(st.booleans()),
        steps_per_revolution=n_l,
        **draw(st.one_of(st.just({}), lidars())),
    )
    assume(task.full_circle or is_one_piece(task))
    return task, pattern, draw(st.integers(0, 2 * n_l * n_s + 3))


def is_one_piece(task):
    """Return whether nothing unseen is between seen beams, from one end of the region."""
    azimuth, _ = beams(task, Pattern(task.steps_per_revolution, 1), task.steps_per_revolution)
    steps = np.diff(np.sort(azimuth)) * task.steps_per_revolution / math.tau
    return bool((np.rint(steps) == 1).all())


ALMOST_A_CIRCLE = Task(
    pitch_min=0.0,
    pitch_max=1.0,
    azimuth=math.nextafter(math.pi, 0.0),
    steps_per_revolution=4,
    window_min=0.0,
    window_max=4.0,
    azimuth_of_step_0=0.0,
)


@settings(max_examples=400)
@given(cases())
@example((ALMOST_A_CIRCLE, Pattern(4, 1, 0.0), 0))
@example((ALMOST_A_CIRCLE, Pattern(4, 3, 0.0), 9))
def test_equals_the_largest_empty_square_grown_from_all_corners(case):
    task, pattern, samples = case
    hole = largest_hole(task, pattern, samples * task.beam_period)
    assert hole.side == pytest.approx(widest_by_corners(task, pattern, samples), abs=1e-8)
    assert_empty(task, pattern, samples, hole)


@settings(max_examples=400)
@given(cases(most=40))
def test_equals_the_largest_of_all_windows(case):
    task, pattern, samples = case
    hole = largest_hole(task, pattern, samples * task.beam_period)
    assert hole.side == pytest.approx(widest_by_windows(task, pattern, samples), abs=1e-8)


@pytest.mark.parametrize('full_circle', [False, True])
@pytest.mark.parametrize(
    ('samples_per_sweep', 'phase', 'duration'),
    [(4001, 0.5, 1.0), (4001, 0.25, 5.0), (1057, 0.0, 5.03), (2745, 2000.5, 3.0), (64, 0.25, 3.0)],
)
def test_equals_the_largest_of_all_windows_of_the_reference_sensor(
    full_circle, samples_per_sweep, phase, duration
):
    task, pattern = Task(full_circle=full_circle), Pattern(1024, samples_per_sweep, phase)
    samples = math.ceil(round(duration / task.beam_period, 6))
    hole = largest_hole(task, pattern, duration)
    assert hole.side == pytest.approx(widest_by_windows(task, pattern, samples), abs=1e-8)
    assert_empty(task, pattern, samples, hole)


def late_beams(task, samples, reversals):
    """Return azimuth and pitch of every beam of a nod that reverses at other instants."""
    n = np.arange(samples)
    sweeps = np.interp(n, reversals, np.arange(len(reversals)))
    pitch = task.pitch_min + task.span * (1.0 - np.abs(sweeps % 2.0 - 1.0))
    azimuth, seen = azimuths(task, n)
    return azimuth[seen], pitch[seen]


@settings(max_examples=300)
@given(cases(), st.one_of(st.floats(0.0, 0.3), st.floats(0.3, 9.0)), st.integers(0, 999))
@example(
    # Three reversals at one instant, after which the nod goes on as after one.
    (
        Task(pitch_min=-0.43, pitch_max=1.52, azimuth=1.83, steps_per_revolution=9),
        Pattern(9, 14, 0.0),
        6,
    ),
    1.5,
    253,
)
def test_late_turns_leave_the_holes_of_their_beams(case, part, seed):
    task, pattern, samples = case
    error = part * pattern.samples_per_sweep
    reversals = reversal_instants(pattern.samples_per_sweep, pattern.phase, error, samples, seed)
    azimuth, pitch = unrolled(task, *late_beams(task, samples, reversals))
    expected = widest_at(task, azimuth, pitch)
    duration = samples * task.beam_period
    hole = largest_hole(task, pattern, duration, reversals)
    assert hole.side == pytest.approx(expected, abs=1e-8)
    assert exceeds(task, pattern, duration, hole.side - 1e-9, reversals)
    assert not exceeds(task, pattern, duration, hole.side + 1e-9, reversals)


def test_turns_on_time_leave_the_holes_of_the_pattern():
    task, pattern = Task(), Pattern(1024, 4001, 0.5)
    for duration in (0.05, 1.0, 7.3):
        reversals = reversal_instants(4001, 0.5, 0.0, math.ceil(duration * 10240), 0)
        late = largest_hole(task, pattern, duration, reversals)
        assert late.side == pytest.approx(largest_hole(task, pattern, duration).side, abs=1e-10)


@settings(max_examples=200)
@given(cases(), st.floats(0.0, 1.5))
@example(
    (
        Task(pitch_min=-1.0167315080289792, pitch_max=0.625, steps_per_revolution=3),
        Pattern(3, 3, 0.0),
        0,
    ),
    0.0,
)
def test_exceeding_a_side_is_having_a_larger_hole(case, part):
    task, pattern, samples = case
    duration = samples * task.beam_period
    hole = largest_hole(task, pattern, duration).side
    for side in (part * hole, hole - 1e-9, hole + 1e-11, hole + 1e-9):
        assert exceeds(task, pattern, duration, side) == (hole > side)
    assert least_side(task) <= hole + 1e-11
    assert hole <= largest_side(task)


@settings(max_examples=100)
@given(
    st.sampled_from([1, 3, 360, 400, 1024, 1440]),
    st.integers(1, 8000),
    st.floats(0.0, 1.0, exclude_max=True),
    st.lists(st.floats(0.0, 20.0), min_size=2, max_size=5),
    st.booleans(),
)
def test_never_grows_and_never_falls_below_a_step(n_l, n_s, part, durations, full_circle):
    task = Task(steps_per_revolution=n_l, full_circle=full_circle, azimuth=1.0)
    pattern = Pattern(n_l, n_s, part * 2 * n_s)
    sides = [largest_hole(task, pattern, t).side for t in [0.0, *sorted(durations), math.inf]]
    assert sides[0] == pytest.approx(task.span)
    assert np.all(np.diff(sides) <= 1e-11)
    assert sides[-1] >= min(task.span, math.tau / n_l, 2.0) - 1e-11


def test_stays_as_it_is_after_a_period():
    task, pattern = Task(), Pattern(1024, 63)
    end = largest_hole(task, pattern, pattern.period * task.beam_period)
    assert largest_hole(task, pattern, math.inf) == largest_hole(task, pattern, 1e12) == end
    assert largest_hole(task, pattern, 0.1).side > end.side


def test_a_full_circle_holds_the_same_hole_wherever_the_nod_begins():
    # After a whole period, beginning a revolution later is the same set of beams.
    task = Task(full_circle=True)
    sides = [
        largest_hole(task, Pattern(1024, 30, (1024 * k + 0.25) % 60), math.inf).side
        for k in range(4)
    ]
    assert sides == pytest.approx([sides[0]] * 4, abs=1e-11)


def test_a_region_that_meets_the_window_at_both_ends_is_refused():
    task = Task(window_min=0.0, window_max=5.0, azimuth=2.0)
    with pytest.raises(ParameterError, match="'azimuth' must be so narrow"):
        largest_hole(task, Pattern(1024, 1057), 60.0)


@pytest.mark.parametrize('azimuth', [2.3, 2.8, math.pi])
def test_what_the_lidar_does_not_measure_is_a_hole(azimuth):
    task = Task(azimuth=azimuth)
    unmeasured = azimuth - -MEASURED_FROM  # the wider of the two strips without lines
    hole = largest_hole(task, Pattern(1024, 1057), 60.0)
    assert hole.side == pytest.approx(unmeasured)
    assert hole.azimuth == pytest.approx(-azimuth + unmeasured / 2.0)


@pytest.mark.parametrize(('azimuth', 'side'), [(0.1, 0.2), (2.0, 1.2272)])
def test_nothing_seen_is_a_square_as_large_as_the_region(azimuth, side):
    assert largest_hole(Task(azimuth=azimuth), Pattern(1024, 4001), 0.0).side == pytest.approx(
        side
    )


def test_one_sample_per_sweep_leaves_what_is_above_and_below_its_beams():
    task = Task(pitch_min=-0.5, pitch_max=0.5)
    assert largest_hole(task, Pattern(1024, 1, 0.5), math.inf).side == pytest.approx(0.5)
    # Beams at 1/4 and 3/4 alternately: none are nearer to each other than half the span.
    assert largest_hole(task, Pattern(1024, 1, 0.25), math.inf).side == pytest.approx(0.5)


@pytest.mark.parametrize('steps', [1, 2, 360, 1440, 16384])
@pytest.mark.parametrize('samples_per_sweep', [1, 1001, 10_000_000])
def test_extremes_have_an_answer(steps, samples_per_sweep):
    task = Task(steps_per_revolution=steps, full_circle=True)
    hole = largest_hole(task, Pattern(steps, samples_per_sweep, 0.25), 3.0)
    assert 0.0 < hole.side <= task.span
    assert math.isfinite(hole.azimuth + hole.pitch)


@pytest.mark.parametrize('duration', [-0.1, math.nan, -math.inf])
def test_a_time_that_is_none_is_refused(duration):
    with pytest.raises(ParameterError, match=r"'duration' must be at least 0 s"):
        largest_hole(Task(), Pattern(1024, 4001), duration)


def test_a_search_that_would_not_end_is_refused():
    task = Task(steps_per_revolution=16384)
    with pytest.raises(ParameterError, match=r"'duration' must be at most 4594.* is inf"):
        largest_hole(task, Pattern(16384, 10_000_000), math.inf)
    with pytest.raises(ParameterError, match='steps_per_revolution'):
        largest_hole(task, Pattern(1024, 4001), 1.0)
