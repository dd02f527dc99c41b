"""By when a joint of ros2_control has to follow: five of its sweeps, or five seconds and one."""

from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.joint_trajectory.trajectory_diagnosis import (
    NodJointState,
    OffNod,
    TrajectoryDiagnosis,
)
from nodlidar_servo.nod.nod_commands import NodCommands
import pytest

S = 10**9


@pytest.mark.parametrize(('sweep', 'by'), [(0.4, 5.4), (1.0, 6.0), (2.0, 10.0), (10.0, 50.0)])
def test_a_joint_that_the_nod_only_passes_has_to_follow_in_time(sweep, by):
    off = OffNod()
    for k in range(20):
        passes = k % 4 == 1
        found = off.follow_by(passes, round((7.0 + k * sweep / 4.0) * S), sweep)
        assert found == round((7.0 + by) * S)


def test_the_rest_of_a_slow_nod_does_not_count_against_the_fast_one_after_it():
    """As when scan_region is cancelled in its first sweep, of ten seconds."""
    off = OffNod()
    off.follow_by(False, 0, 10.0)
    for k in range(1, 80):
        off.follow_by(True, k * S // 10, 10.0)
    assert off.follow_by(False, 8 * S, 0.4) > 13 * S
    off.follow_by(True, 9 * S, 0.4)
    assert off.follow_by(True, 9 * S + S // 2, 0.4) is None
    assert off.follow_by(False, 60 * S, 0.4) == 60 * S + round(5.4 * S)


def test_a_joint_outside_of_the_mount_and_positions_that_it_cannot_have_are_warned_of():
    diagnosis = TrajectoryDiagnosis(NodCommands(TrajectoryConfig()))
    diagnosis.next_report(0)
    diagnosis.state = NodJointState(impossible=3, pitch=1.234, is_outside=True)
    report = diagnosis.next_report(S)
    assert report.warnings[:2] == (
        '3 joint states with an impossible position',
        'the joint is at 1.23 rad, outside of the mount',
    )
    diagnosis.state = NodJointState(impossible=3, pitch=0.7)
    report = diagnosis.next_report(4 * S)
    assert not any('joint is at' in each or 'impossible' in each for each in report.warnings)


@pytest.mark.parametrize(('error', 'words'), [(0.3, '0.30 s before'), (-0.08, '0.08 s after')])
def test_stamps_that_are_wrong_are_warned_of(error, words):
    diagnosis = TrajectoryDiagnosis(NodCommands(TrajectoryConfig()))
    diagnosis.state = NodJointState(stamp_error=error)
    warnings = diagnosis.next_report(S).warnings
    (told,) = [each for each in warnings if f'at least {words} they arrive' in each]
    assert ('unless' in told) is (error > 0.0)  # none arrives before it is measured
    diagnosis.state = NodJointState()
    assert not any('stamped' in each for each in diagnosis.next_report(2 * S).warnings)


def test_an_offset_from_the_nod_is_warned_of():
    diagnosis = TrajectoryDiagnosis(NodCommands(TrajectoryConfig()))
    diagnosis.state = NodJointState(offset=-0.15)
    assert any('-0.15 rad off the nod' in each for each in diagnosis.next_report(S).warnings)
    diagnosis.state = NodJointState()
    assert not any('off the nod' in each for each in diagnosis.next_report(2 * S).warnings)
