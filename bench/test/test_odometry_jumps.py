"""The measurement of jumps: what is put in, and how the outcome is judged."""

from dataclasses import dataclass

import numpy as np
import pytest

from bench.maps.odometry_jumps import judged, with_jump

NS = 10**9
STAMPS = np.arange(6) * NS


@dataclass(frozen=True)
class Odometry:
    """What a recording says of it."""

    odometry_stamp_ns: np.ndarray
    odometry_pose: np.ndarray


def test_after_a_jump_the_way_goes_on_from_another_pose():
    straight = np.column_stack([np.arange(6.0), np.zeros(6), np.zeros(6)])
    jumped = with_jump(Odometry(STAMPS, straight), 2 * NS, np.array([0.5, 0.0, np.pi / 2.0]))
    expected = [(0, 0), (1, 0), (2, 0), (2.5, 1), (2.5, 2), (2.5, 3)]
    np.testing.assert_allclose(jumped.odometry_pose[:, :2], expected, atol=1e-12)
    np.testing.assert_allclose(jumped.odometry_pose[3:, 2], np.pi / 2.0)


@pytest.mark.parametrize(
    ('off', 'lost', 'end', 'seconds', 'unnoticed'),
    [
        ([0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], 'right', 0.0, 0),
        ([0, 0, 1, 1, 0, 0], [0, 0, 1, 0, 0, 0], 'right', 2.0, 1),
        ([0, 0, 1, 1, 1, 1], [0, 0, 1, 0, 0, 0], 'wrong', np.nan, 3),
        ([0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 1], 'lost', np.nan, 0),
        ([1, 1, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], 'right', 0.0, 0),
    ],
)
def test_the_outcome(off, lost, end, seconds, unnoticed):
    trial = judged(np.array(off, dtype=float), np.array(lost, dtype=bool), STAMPS, NS)
    assert (trial.end, trial.unnoticed) == (end, unnoticed)
    assert trial.seconds == pytest.approx(seconds, nan_ok=True)
