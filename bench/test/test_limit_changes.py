"""The real servo loop is on a nod of other limits within one sweep, and within 1 s."""

import pytest

from bench.nod.limit_changes import change, KINDS


@pytest.mark.parametrize('kind', [kind for kind in KINDS if kind != 'far away'])
@pytest.mark.parametrize('seed', range(1000, 1003))
def test_a_change_is_complete_within_one_sweep_and_1_s(seed, kind):
    found = change(seed, kind)
    assert found.beyond_sweep <= 0.0
    assert found.taken <= 1.0


@pytest.mark.parametrize('seed', range(1000, 1003))
def test_limits_that_are_far_away_are_reached_within_1_s(seed):
    assert change(seed, 'far away').taken <= 1.0
