"""The field sigma against the true errors of a recording with real devices."""

import pytest

from bench.errors.sigma import BELOW, BELOW_TWO, row_of, SLOW


@pytest.mark.parametrize('scene', ['corridor', 'corner'])
def test_as_many_points_are_below_sigma_as_of_normal_errors_about(scene):
    """Along one axis 68 and 95 % would be, of two equal axes 63 and 98 %."""
    shares = row_of(scene, SLOW, 2.0)
    assert 55.0 < shares[BELOW] < 75.0
    assert 92.0 < shares[BELOW_TWO] < 99.0
