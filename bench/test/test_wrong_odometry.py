"""The measurement of wrong odometry: what is put in, and how the outcome is judged."""

from dataclasses import dataclass

import numpy as np
import pytest

from bench.maps.odometry_jumps import judged, with_jump
from bench.maps.odometry_slips import counted

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


def test_odometry_counts_wrong_for_a_while():
    """One metre a second, and after the third, a turn to the left of 0.2 rad each."""
    yaw = np.array([0.0, 0.0, 0.0, 0.2, 0.4, 0.6])
    poses = np.column_stack([np.arange(6.0), np.zeros(6), yaw])
    wrong = counted(Odometry(STAMPS, poses), NS, 2.0, 1.5).odometry_pose
    np.testing.assert_allclose(wrong[:4], [(0, 0, 0), (1, 0, 0), (2.5, 0, 0), (4, 0, 0.3)])
    np.testing.assert_allclose(wrong[:, 2] - yaw, [0.0, 0.0, 0.0, 0.1, 0.1, 0.1], atol=1e-12)
    way = np.linalg.norm(np.diff(wrong[:, :2], axis=0), axis=1)
    np.testing.assert_allclose(way, [1.0, 1.5, 1.5, 1.0, 1.0])


@pytest.mark.parametrize(
    ('off', 'lost', 'end', 'seconds', 'unnoticed', 'largest'),
    [
        ([0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], 'right', 0.0, 0, 0.0),
        ([0, 0, 2, 1, 0, 0], [0, 0, 1, 0, 0, 0], 'right', 2.0, 1, 1.0),
        ([0, 0, 1, 1, 3, 1], [0, 0, 1, 0, 0, 0], 'wrong', np.nan, 3, 3.0),
        ([0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 1], 'lost', np.nan, 0, 0.0),
        ([1, 1, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], 'right', 0.0, 0, 0.0),
    ],
)
def test_the_outcome(off, lost, end, seconds, unnoticed, largest):
    trial = judged(np.array(off, dtype=float), np.array(lost, dtype=bool), STAMPS, NS)
    assert (trial.end, trial.unnoticed, trial.largest) == (end, unnoticed, largest)
    assert trial.lost == sum(lost)
    assert trial.seconds == pytest.approx(seconds, nan_ok=True)
