"""What the publication claims, counted sample by sample (docs/publication.md, "Verdicts").

Nothing here uses the code of the packages. Directions are integers, so equal means equal.
"""

from fractions import Fraction
from math import asin, gcd, pi

from hypothesis import assume, given
from hypothesis import strategies as st
import numpy as np
import pytest

from figures.test.enumeration import (
    completion,
    crossings,
    denominator,
    directions,
    distinct,
    hit_cells,
    longest_gaps,
    N_L,
    repeats_by_height,
)

SPAN = 1.2272
TABLE_I = (3000, 3009, 4000, 4009, 5000, 5009, 6000, 6009, 7000, 7009)
odd = st.integers(0, 40).map(lambda k: 2 * k + 1)
even = st.integers(1, 20).map(lambda k: 2 * k)


# Theorem 1


def test_theorem_1_needs_a_phase_that_is_not_whole():
    period = 4007 * N_L
    assert distinct(directions(N_L, [(4007, period)], (0, 1))) == 2_052_096
    assert distinct(directions(N_L, [(4007, period)], (1, 2))) == period == 4_103_168


def test_the_period_is_n_s_frames_and_n_s_n_l_samples():
    """The text counts N_S * N_L "laser frames"; a frame is a revolution, of N_L samples."""
    pairs = directions(64, [(21, 3 * 21 * 64)])
    returns = [
        n for n in range(1, 2 * 21 * 64 + 1) if np.array_equal(pairs[n : n + 42], pairs[:42])
    ]
    assert returns == [21 * 64, 2 * 21 * 64]


@pytest.mark.parametrize(('first', 'then', 'shared'), [(4001, 4003, 1024), (2745, 4005, 46_080)])
def test_theorem_1_is_false_for_a_speed_that_changes(first, then, shared):
    """Every N_s is coprime with N_L, and the nod changes its speed at a reversal only."""
    sweeps = [(first, first * N_L), (then, then * N_L)]
    pairs = directions(N_L, sweeps)
    assert len(pairs) - distinct(pairs) == shared == N_L * gcd(first, then)


@given(even, odd, odd)
def test_two_odd_n_s_share_as_many_rows_as_their_common_divisor(steps, first, then):
    assume(first != then and gcd(steps, first) == gcd(steps, then) == 1)
    pairs = directions(steps, [(first, first * steps), (then, then * steps)])
    assert len(pairs) - distinct(pairs) == steps * gcd(first, then)


@given(even, odd, st.lists(st.integers(1, 5), min_size=2, max_size=3, unique=True), st.data())
def test_phases_of_other_powers_of_a_half_share_nothing(steps, n_s, powers, data):
    """Odd multiples of 2**-p / N_s, N_s odd: the power of two in the denominator differs."""
    rows = set()
    count = 0
    for power in powers:
        other = data.draw(odd.filter(lambda n: gcd(n, steps) == 1)) if gcd(n_s, steps) > 1 else n_s
        sweep, phase = [(other, other * steps)], (1, 2**power)
        whole = denominator(sweep, phase)
        found = directions(steps, sweep, phase).tolist()
        rows |= {(step, Fraction(height, whole)) for step, height in found}
        count += len(found)
    assert len(rows) == count


# Fig. 4 and the speeds


@pytest.mark.parametrize(('phase', 'repeats'), [((0, 1), 200), ((1, 2), 0)])
def test_fig_4_has_two_hundred_repeats_without_a_phase(phase, repeats):
    pairs = directions(N_L, [(4007, 40 * N_L)], phase)
    assert len(pairs) - distinct(pairs) == repeats


@pytest.mark.parametrize(
    ('span', 'beam_period'), [(pi / 2, 125e-6), (SPAN, 0.1 / N_L)], ids=['pi/2', '1.2272']
)
def test_all_four_speeds_fit_two_spans(span, beam_period):
    """Eq. (2), span / (N_s T_s). With the stated span and 10 revolutions a second none fits."""
    for n_s, published in ((4007, 3.136), (4000, pi), (3000, 4.189), (7000, 1.795)):
        assert span / (n_s * beam_period) == pytest.approx(published, abs=1e-3)
        assert pi / 2 / (n_s * 0.1 / N_L) > 1.25 * published
    assert pi / 2 / (4007 * 0.1 / N_L) == pytest.approx(4.014, abs=5e-4)


# Eq. (6)-(9), Eq. (23)


def turned(axis, cosine, sine, vector):
    """Return a vector turned about an axis by the right hand (Rodrigues), in fractions."""
    along = sum(a * v for a, v in zip(axis, vector, strict=True)) * (1 - cosine)
    x, y, z = axis
    across = (
        y * vector[2] - z * vector[1], z * vector[0] - x * vector[2], x * vector[1] - y * vector[0]
    )  # fmt: skip
    return tuple(
        v * cosine + c * sine + a * along
        for v, c, a in zip(vector, across, axis, strict=True)
    )  # fmt: skip


def test_the_rotation_of_eq_23_turns_a_beam_down():
    """REP 103: x forward, y left, z up. A positive turn about +y is down, about -y up."""
    cosine, sine = Fraction(4, 5), Fraction(3, 5)
    forward, up = (1, 0, 0), (0, 0, 1)
    assert turned((0, 1, 0), cosine, sine, forward) == (cosine, 0, -sine)
    assert turned((0, -1, 0), cosine, sine, forward) == (cosine, 0, sine)
    # Erratum 2: the lever arm along z goes back as the beam goes up.
    assert turned((0, -1, 0), cosine, sine, up) == (-sine, 0, cosine)


def test_t_over_its_size_is_not_the_direction_of_the_nod():
    heights = directions(N_L, [(1001, 4 * 1001)])[:, 1]
    rises = np.diff(heights) > 0
    assert 0.49 < np.mean(rises) < 0.51


# Fig. 6


def cells_at(distance):
    """Return columns, rows and the side of a cell for 10 cm, full circle, span pi/2."""
    cell = 2.0 * asin(0.05 / distance)
    return int(np.ceil(2.0 * pi / cell)), int(np.ceil(pi / 2 / cell)), cell


@pytest.mark.parametrize(
    ('distance', 'faster'),
    [(0.5, 0.13), (1.0, 0.38), (1.5, 0.22), (2.0, 0.54), (3.0, 0.25)],
)
def test_fig_6a_the_published_n_s_is_among_the_faster_ones_but_at_two_metres(distance, faster):
    """A sample of every ninth odd N_s; each is walked up to the completion of N_s = 2745."""
    columns, rows, cell = cells_at(distance)
    last = completion(2745, columns, rows, cell, pi / 2)
    others = [
        hit_cells(n_s, last, columns, rows, cell, pi / 2).all() for n_s in range(1001, 8000, 18)
    ]
    assert np.mean(others) == pytest.approx(faster, abs=0.06)


def test_fig_6a_the_start_pitch_changes_the_completion_little_for_most_n_s():
    """But a lot for some, such as 2401."""
    ratios = []
    for n_s in range(1001, 8000, 700):
        starts = np.linspace(0, n_s - 1, 8).astype(int).tolist()
        ends = [completion(n_s, *cells_at(2.0), pi / 2, (2 * each + 1, 2)) for each in starts]
        ratios.append(max(ends) / min(ends))
    assert np.median(ratios) == pytest.approx(1.06, abs=0.01)
    assert max(ratios) > 1.5


def test_fig_6b_the_start_pitch_changes_the_revisit_next_to_nothing():
    columns, rows, cell = cells_at(2.0)
    means = []
    for start in (0, 411, 1372, 2744):  # samples past the lower limit, and half of one
        gaps = longest_gaps(2745, rows, cell, pi / 2, (2 * start + 1, 2))
        assert len(gaps) == columns * rows
        means.append(gaps.mean() * 0.1 / N_L)
    assert means == pytest.approx([5.58] * 4, rel=0.01)


@pytest.mark.parametrize(('distance', 'frequency'), [(1.0, 0.68), (2.0, 0.338), (4.0, 0.170)])
def test_fig_6c_the_hit_frequency_falls_as_the_number_of_cells_grows(distance, frequency):
    columns, rows, cell = cells_at(distance)
    crossed = crossings(2745, columns, rows, cell, pi / 2) / (2745 * 0.1 * columns * rows)
    assert crossed == pytest.approx(frequency, rel=0.01)


# Fig. 10a


@pytest.mark.parametrize(('n_s', 'near'), [(3009, 0.35), (5009, 0.13), (7009, 0.06)])
def test_fig_10a_beams_repeat_near_the_reversals_only(n_s, near):
    beam_period = 0.1 / N_L
    share, beams = repeats_by_height(n_s, SPAN / (n_s * beam_period), 200.0, beam_period)
    outer = np.r_[:10, 90:100]
    assert np.average(share[outer], weights=beams[outer]) == pytest.approx(near, abs=0.006)
    assert share[10:90].max() == 0.0


# Fig. 8


def test_fig_8_one_pitch_for_each_scan_shows_what_is_ahead_twice():
    """The beam straight ahead, step 384, comes 340 samples after the first one, step 44."""
    rows = directions(N_L, [(4000, 200 * N_L)])[:, 1].reshape(200, N_L) / 2.0  # of the finest grid
    error = rows[:, 44] - rows[:, 384]
    up, down = np.isclose(error, -340.0), np.isclose(error, 340.0)
    assert 0.4 < up.mean() < 0.5
    assert 0.4 < down.mean() < 0.5
    # Apart by 0.21 rad at pi rad/s; the pitches between two samples leave one image.
    images_apart = 2 * 340 * SPAN / 4000
    assert images_apart == pytest.approx(0.2086, abs=1e-4)
    between = rows[:, 44] + (rows[:, 725] - rows[:, 44]) * (340 / 681)
    reverses = np.abs(rows[:, 725] - rows[:, 44]) < 680.5
    assert np.abs(between - rows[:, 384])[~reverses].max() < 1e-9


# Fig. 10 and Table I


@pytest.mark.parametrize('n_s', TABLE_I)
def test_repeats_by_the_published_definition(n_s):
    """Same azimuth, pitch within one step of 0.005 rad: N_s / 245 hits of a bin in N_s frames."""
    step, halves = directions(N_L, [(n_s, n_s * N_L)]).T
    bins = np.floor(halves * (SPAN / (2 * n_s) / 0.005)).astype(np.int64)
    hits = np.bincount(step * 246 + bins, minlength=246 * N_L).reshape(N_L, 246)
    assert hits[:, :245].mean() == pytest.approx(n_s / 245.44, rel=0.005)
    repeats = 1.0 - np.count_nonzero(hits) / hits.sum()
    every_bin_hit = 1.0 - 246 / n_s
    if n_s % 2:
        assert repeats == pytest.approx(every_bin_hit, abs=1e-12)
    else:  # a common divisor leaves some bins unseen
        assert every_bin_hit - 1e-12 < repeats < every_bin_hit + 0.035


@pytest.mark.parametrize('n_s', TABLE_I)
def test_repeats_on_the_finest_grid_are_those_of_the_common_divisor(n_s):
    pairs = directions(N_L, [(n_s, n_s * N_L)])
    assert Fraction(distinct(pairs), len(pairs)) == Fraction(1, gcd(n_s, N_L))
