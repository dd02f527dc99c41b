"""Joint positions that scatter about the motion."""

from nodlidar_assembler.plausibility.joint_scatter import JointScatter
import numpy as np
import pytest

PERIOD_NS = 10_000_000
START_NS = 1_700_000_000 * 10**9


def warning(noise, repeated):
    """Return the warning for a nod with noise [rad], some samples sent so many times."""
    scatter = JointScatter('nod')
    draw = np.random.default_rng(1).normal(0.0, noise, 3000)
    for number, error in enumerate(draw):
        sample = START_NS + number * PERIOD_NS, 0.5 * np.sin(number / 40.0) + error
        for _ in range(repeated if number in (700, 701, 799, 800) else 1):
            scatter.add(sample)
    return scatter.warning


@pytest.mark.parametrize('repeated', [1, 2, 3])
def test_samples_that_are_sent_again_change_nothing(repeated):
    assert 'scatter by 10 mrad RMS' in warning(1e-2, repeated)
    assert warning(1e-3, repeated) == ''


def test_it_is_named_again_after_time_went_back():
    scatter = JointScatter('nod')
    for _ in range(2):
        for number, error in enumerate(np.random.default_rng(2).normal(0.0, 1e-2, 1500)):
            scatter.add((START_NS + number * PERIOD_NS, error))
        assert 'scatter by 10 mrad RMS' in scatter.warning
