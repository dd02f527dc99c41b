"""Repeats on the finest grid: closed forms, enumeration, and beams at random."""

import math

from nodlidar_planner.choice.timing_error import reversal_instants
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np
import pytest

from figures.repeats import (
    _by_speed,
    AT_RANDOM,
    error_where,
    ERRORS,
    N_L,
    PUBLISHED,
    share_of_repeats,
)


def held(samples_per_sweep, error, seed=1, phase=0.5):
    return reversal_instants(samples_per_sweep, phase, error, samples_per_sweep * N_L, seed)


@pytest.mark.parametrize('n_s', [n_s for pair in PUBLISHED for n_s in pair])
def test_without_error_the_share_is_that_of_the_common_divisor(n_s):
    """N_s N_L beams in 1/g of the cells, evenly (docs/model.md): 1 - 1/g are repeats."""
    assert share_of_repeats(n_s, held(n_s, 0.0)) == 1.0 - 1.0 / math.gcd(n_s, N_L)


@pytest.mark.parametrize(('n_s', 'phase'), [(1001, 0.5), (1008, 0.5), (1024, 100.25)])
def test_the_share_is_that_of_the_enumerated_pattern(n_s, phase):
    n = np.arange(n_s * N_L)
    pattern = Pattern(N_L, n_s, phase)
    row = np.minimum(np.floor(pattern.height(n)), n_s - 1)
    cells = len(np.unique(pattern.step(n) * n_s + row))
    share = share_of_repeats(n_s, held(n_s, 0.0, phase=phase))
    assert share == pytest.approx(1.0 - cells / len(n), abs=1e-12)


@pytest.mark.parametrize('n_s', [1500, 1501])
def test_a_millisecond_of_error_makes_the_parity_vanish(n_s):
    assert share_of_repeats(n_s, held(n_s, 10.24)) == pytest.approx(AT_RANDOM, abs=0.02)


def test_error_spoils_an_odd_n_s_and_helps_an_even_one():
    odd = [share_of_repeats(1501, held(1501, error)) for error in (0.0, 0.3, 1.0, 3.0)]
    even = [share_of_repeats(1504, held(1504, error)) for error in (0.0, 0.3, 1.0, 3.0)]
    assert odd == sorted(odd)
    assert even == sorted(even, reverse=True)


def test_the_error_is_found_where_a_line_crosses_the_ratio():
    assert error_where(ERRORS / 100.0, 0.0234) == pytest.approx(2.34)


def test_the_speed_register_cannot_tell_most_pairs_apart():
    """The step is 0.111 rpm; N_s goes with the inverse of the speed (docs/model.md)."""
    at_4000 = 1.2272 / (4000 * 0.1 / 1024)
    steps = [[round(at_4000 * 4000 / n_s / 0.011624) for n_s in pair] for pair in PUBLISHED]
    assert [odd - even for even, odd in steps] == [-1, 0, 0, 0, 0]
    for pair, (even, odd) in zip(PUBLISHED, steps, strict=True):
        reversals = [_by_speed(n_s, 0.0, 1) for n_s in pair]
        assert (reversals[0][:9] == reversals[1][:9]).all() == (even == odd)
