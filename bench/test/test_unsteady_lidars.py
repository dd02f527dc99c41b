import numpy as np
import pytest

from bench.devices.unsteady_lidars import DRIFTS, N_L, NOT_WHOLE, revolutions, seen, STEADY


@pytest.mark.parametrize('name', [STEADY, NOT_WHOLE, DRIFTS])
def test_the_nod_of_the_node_sees_all_and_whole_revolutions_do_not(name):
    assert seen(name, 3309, 20.0) > 0.999
    assert seen(name, 5 * N_L, 20.0) < 0.25


def test_the_speed_drifts_by_a_hundredth():
    speed = np.diff(revolutions(DRIFTS, np.arange(0.0, 7.0, 1e-3))) / 1e-3
    assert speed.max() == pytest.approx(10.1, abs=1e-3)
    assert speed.min() == pytest.approx(9.9, abs=1e-3)
    assert np.diff(revolutions(NOT_WHOLE, np.array([0.0, 1.0]))) == pytest.approx(9.9918, abs=1e-4)
