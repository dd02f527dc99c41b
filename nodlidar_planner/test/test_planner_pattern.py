"""The pattern against enumeration in integers, and the counts that docs/model.md states."""

from fractions import Fraction
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np
import pytest

MOST_SAMPLES = 10_000_000
small = st.integers(1, 64)
steps = st.one_of(st.sampled_from([1, 360, 1024, 1440, 16_384, 65_536]), st.integers(1, 65_536))
samples = st.one_of(small, st.integers(1, MOST_SAMPLES))


@st.composite
def patterns(draw, n_l=steps, n_s=samples):
    """Return a pattern whose phase is any number of quarters, both ends of the range included."""
    n_s = draw(n_s)
    quarters = draw(st.one_of(st.sampled_from([0, 8 * n_s - 1]), st.integers(0, 8 * n_s - 1)))
    return Pattern(draw(n_l), n_s, quarters / 4)


def quarter_heights(pattern, n):
    """Return the heights of samples in quarters, from the definition, in integers."""
    m = 4 * n + round(4 * pattern.phase)
    half = 4 * pattern.samples_per_sweep
    return half - abs(m % (2 * half) - half)


def hits(pattern):
    """Return how often the samples of a period hit each (step, quarter height)."""
    n_l, heights = pattern.steps_per_revolution, 4 * pattern.samples_per_sweep + 1
    n = np.arange(pattern.period)
    direction = n % n_l * heights + quarter_heights(pattern, n)
    return np.bincount(direction, minlength=n_l * heights).reshape(n_l, heights)


def finest_grid(pattern):
    """Return the hits of the cells of the finest grid, N_L steps by N_s rows (k + 1/2)."""
    found = hits(pattern)
    assert found[:, 2::4].sum() == found.sum()
    return found[:, 2::4]


# Directions of samples


@given(patterns(), st.integers(0, 2**62))
def test_step_and_height_are_exact_at_any_sample(pattern, n):
    assert pattern.step(n) == n % pattern.steps_per_revolution
    assert 4 * pattern.height(n) == quarter_heights(pattern, n)


@given(samples, st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 2**62))
def test_height_is_rounded_once_for_any_phase(n_s, turn, n):
    phase = min(turn * 2 * n_s, math.nextafter(2 * n_s, 0.0))
    exact = n_s - abs((n + Fraction(phase)) % (2 * n_s) - n_s)
    assert Pattern(1024, n_s, phase).height(n) == float(exact)


def test_pitch_runs_between_the_limits():
    pitch = Pattern(8, 4, 0.0).pitch(np.arange(9), -0.4, 0.4)
    assert pitch == pytest.approx([-0.4, -0.2, 0.0, 0.2, 0.4, 0.2, 0.0, -0.2, -0.4])


@given(patterns(n_s=small))
def test_the_leg_is_known_also_at_the_reversals(pattern):
    """Erratum 4: t/|t| is equal on both legs, and undefined at t = 0."""
    n = np.arange(pattern.cycle)
    m = (4 * n + round(4 * pattern.phase)) % (8 * pattern.samples_per_sweep)
    assert np.array_equal(pattern.going_up(n), m < 4 * pattern.samples_per_sweep)


@given(patterns(small, small))
def test_period_is_the_first_return_to_the_start(pattern):
    n_l, cycle = pattern.steps_per_revolution, 2 * pattern.samples_per_sweep
    first = next(n for n in range(1, n_l * cycle + 1) if n % n_l == n % cycle == 0)
    assert pattern.period == first


# Erratum 1: counts


@pytest.mark.parametrize('n_l', range(1, 13))
def test_distinct_directions_of_all_small_patterns(n_l):
    for n_s in range(1, 13):
        for quarters in range(8 * n_s):
            pattern = Pattern(n_l, n_s, quarters / 4)
            assert pattern.distinct_directions == np.count_nonzero(hits(pattern)), pattern


@given(patterns(small, small))
def test_distinct_directions_are_those_of_the_enumeration(pattern):
    assert pattern.distinct_directions == np.count_nonzero(hits(pattern))


fraction = st.floats(0.0, 1.0, exclude_min=True, exclude_max=True)


@given(steps, samples, fraction.filter(lambda phase: phase != 0.5))
def test_all_samples_are_distinct_where_twice_the_phase_is_not_whole(n_l, n_s, phase):
    assert Pattern(n_l, n_s, phase).distinct_directions == math.lcm(n_l, 2 * n_s)


def test_without_a_phase_half_of_the_published_pattern_repeats():
    pattern = Pattern(1024, 4007, 0.0)
    assert pattern.period == 1024 * 4007
    assert pattern.distinct_directions == (1024 * 4007 + 1024) // 2 == 2_052_096
    assert np.count_nonzero(hits(pattern)) == 2_052_096
    assert Pattern(1024, 4007).distinct_directions == pattern.period


@pytest.mark.parametrize(('n_l', 'n_s'), [(2, 1), (8, 5), (64, 21), (360, 77), (1024, 1001)])
def test_half_a_sample_fills_every_cell_of_the_finest_grid_once(n_l, n_s):
    assert np.all(finest_grid(Pattern(n_l, n_s, 0.5)) == 1)


@pytest.mark.parametrize(('n_l', 'n_s'), [(1, 1), (1, 8), (5, 8), (63, 20), (625, 401)])
def test_odd_steps_fill_the_finest_grid_twice_by_half_a_sample(n_l, n_s):
    pattern = Pattern(n_l, n_s, 0.5)
    assert pattern.period == 2 * n_l * n_s
    assert np.all(finest_grid(pattern) == 2)


@pytest.mark.parametrize(('n_l', 'n_s'), [(1, 1), (1, 8), (5, 8), (63, 20), (625, 401)])
def test_odd_steps_fill_a_grid_twice_as_fine_once_by_a_quarter_of_a_sample(n_l, n_s):
    pattern = Pattern(n_l, n_s, 0.25)
    found = hits(pattern)
    assert found.sum() == 2 * n_l * n_s
    assert np.all(found[:, 1::2] == 1)


def unseen_share(n_l, n_s):
    """Return the share of the finest grid that the half-sample nod never hits, as documented."""
    g = math.gcd(n_l, 2 * n_s)
    return 1 - Fraction(2, g) if g % 2 == 0 else (1 - Fraction(1, g)) ** 2


@given(small, small)
def test_a_common_divisor_leaves_cells_of_the_finest_grid_unseen(n_l, n_s):
    never = np.count_nonzero(finest_grid(Pattern(n_l, n_s)) == 0)
    assert Fraction(never, n_l * n_s) == unseen_share(n_l, n_s)


@pytest.mark.parametrize('n_s', [1, 2, 7, 64])
def test_as_many_samples_per_sweep_as_steps_draw_two_frames_for_ever(n_s):
    pattern = Pattern(n_s, n_s)
    assert pattern.period == 2 * n_s
    assert pattern.distinct_directions == np.count_nonzero(hits(pattern))


def test_the_published_choice_is_coprime_with_the_published_lidar_only():
    """Erratum 5: odd is coprime with 1024, and says nothing about 1440."""
    assert np.all(finest_grid(Pattern(1024, 2745)) == 1)
    assert np.mean(finest_grid(Pattern(1440, 2745)) == 0) == 1 - 2 / 90


# Starts


@given(patterns(small, small))
def test_another_start_is_another_frame_of_the_same_period(pattern):
    n_l, n_s = pattern.steps_per_revolution, pattern.samples_per_sweep
    stride, cycle = math.gcd(n_l, 2 * n_s), 2 * n_s
    base = Pattern(n_l, n_s, pattern.phase % stride)
    shift = int(pattern.phase - base.phase)
    frame = next(k for k in range(cycle) if (k * n_l - shift) % cycle == 0)
    n = np.arange(pattern.period)
    assert np.array_equal(pattern.height(n), base.height(n + frame * n_l))
    assert np.array_equal(pattern.step(n), base.step(n + frame * n_l))


# Limits


def test_ten_million_samples_per_sweep_are_as_quick_as_ten():
    pattern = Pattern(65_536, MOST_SAMPLES - 1)
    assert pattern.period == pattern.distinct_directions == 65_536 * (MOST_SAMPLES - 1)
    assert Pattern(2**30, 2**30 - 1, 0.0).distinct_directions == 2**29 * 2**30


@pytest.mark.parametrize('key', ['steps_per_revolution', 'samples_per_sweep'])
@pytest.mark.parametrize('value', [0, -1, 2**30 + 1, 4.0, math.nan, math.inf, None, '7'])
def test_a_count_that_is_none_is_refused(key, value):
    counts = {'steps_per_revolution': 8, 'samples_per_sweep': 5, key: value}
    with pytest.raises(ParameterError) as refusal:
        Pattern(**counts)
    assert refusal.value.key == key
    assert refusal.value.limit == 'a whole number from 1 to 1073741824'
    assert refusal.value.value is value


@pytest.mark.parametrize('phase', [-0.25, 10.0, math.nan, math.inf, -math.inf])
def test_a_phase_outside_one_nod_is_refused(phase):
    with pytest.raises(ParameterError, match="'phase' must be at least 0 and below 10") as refusal:
        Pattern(8, 5, phase)
    assert refusal.value.value is phase


def test_numpy_counts_are_kept_as_python_s():
    pattern = Pattern(np.int32(65_536), np.int32(9_999_999))
    assert pattern.period == 65_536 * 9_999_999
    assert type(pattern.samples_per_sweep) is int


@given(st.integers(1, 3000), st.integers(1, 3000))
def test_it_repeats_sooner_by_as_much_as_the_period_is_shorter(steps, n_s):
    """A coprime N_s has N_L N_s samples in a period, or 2 N_L N_s where N_L is odd."""
    pattern = Pattern(steps, n_s)
    longest = steps * n_s * (1 if steps % 2 == 0 else 2)
    assert pattern.repeats * pattern.period == longest
