"""The error budget against the simulator, in two of the recorded set-ups; its cubature."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from bench.errors.budget_setups import drawn_setup
from bench.errors.error_budget import RATIO, row_of
from bench.errors.simulated_error import cubature

DRIVING, BY_PHYSICS = 15, 14


@pytest.mark.parametrize('seed', [DRIVING, BY_PHYSICS])
def test_the_budget_is_that_of_the_simulator_within_15_percent(seed):
    setup = drawn_setup(seed)
    assert any(setup.scene.base_velocity) == (seed == DRIVING)
    assert (setup.scene.servo is not None) == (seed == BY_PHYSICS)
    assert row_of(setup, 3.0)[RATIO] == pytest.approx(1.0, abs=0.15)


@given(st.lists(st.floats(0.0, 10.0), min_size=1, max_size=9))
def test_a_cubature_has_the_given_deviations_and_no_correlation(deviations):
    points = np.array(list(cubature(deviations)))
    assert np.abs(points.mean(axis=0)).max() < 1e-12
    products = points.T @ points / len(points)
    assert products == pytest.approx(np.diag(np.square(deviations)), abs=1e-9)
