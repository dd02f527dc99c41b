"""What is kept of one input while another is missing has an end, and costs no pause later."""

import time

from nodlidar_assembler.clouds.joint_history import JointHistory, MOST_SAMPLES
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.point_layout import POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.reversals import MOST_SAMPLES as MOST_REVERSAL_SAMPLES
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.clouds.sweeps import MOST_REVERSALS, MOST_SCANS, SweepGatherer
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps, MOST_COMMANDED
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.revolutions import Revolutions, WINDOW
from nodlidar_assembler.waiting import MOST_WAITING, WaitingLine
from nodlidar_common.nod import Nod
import numpy as np
import pytest
from sensor_msgs.msg import JointState

S = 1_000_000_000
BEGIN_NS = 1_700_000_000 * S


def points_at(time_ns):
    return Points(np.array([time_ns], dtype=np.int64), np.zeros(1, POINT))


def test_a_day_of_reversals_without_points_is_not_kept_and_costs_no_pause():
    gatherer = SweepGatherer(30.0)
    gatherer.add_scan(points_at(BEGIN_NS))
    for k in range(221_184):  # of the reference nod
        gatherer.add_reversal(BEGIN_NS + k * 390_625_000)
    assert len(gatherer._reversals_ns) <= 160
    begin = time.process_time()
    first = gatherer.add_scan(points_at(BEGIN_NS + 86_400 * S))
    assert time.process_time() - begin < 0.1
    assert [len(cloud.data) for cloud in first] == [1]


def test_reversals_at_one_instant_are_not_kept_for_ever():
    gatherer = SweepGatherer(30.0)
    for _ in range(2 * MOST_REVERSALS):
        gatherer.add_reversal(BEGIN_NS)
    assert len(gatherer._reversals_ns) == MOST_REVERSALS


def test_scans_of_nearly_one_instant_make_a_cloud_after_some_time():
    gatherer, scans = SweepGatherer(30.0), (points_at(BEGIN_NS + k) for k in range(9000))
    clouds = [cloud for _ in range(2 * MOST_SCANS + 1) for cloud in gatherer.add_scan(next(scans))]
    assert [len(cloud.data) for cloud in clouds] == [MOST_SCANS, MOST_SCANS]


@pytest.mark.parametrize('apart_ns', [0, 1])
def test_samples_of_nearly_one_instant_are_not_kept_for_ever(apart_ns):
    joint, odometry, reversals = JointHistory(), OdometryHistory(), ReversalFinder()
    for k in range(2 * MOST_SAMPLES):
        joint.add(BEGIN_NS + k * apart_ns, 0.0)
        odometry.add(BEGIN_NS + k, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        reversals.add(BEGIN_NS + k, 0.0)
    assert len(joint.between(0, 2 * BEGIN_NS).time_ns) == MOST_SAMPLES
    assert len(odometry.around(0, 2 * BEGIN_NS).time_ns) == MOST_SAMPLES
    assert len(reversals._samples) == MOST_REVERSAL_SAMPLES


def test_scans_that_wait_on_a_clock_that_stands_still_are_not_kept_for_ever():
    waiting = WaitingLine(300_000_000)
    for k in range(2 * MOST_WAITING):
        waiting.add(k, BEGIN_NS)
        list(waiting.release(BEGIN_NS, lambda k, overdue: overdue or None))
    assert len(waiting._waiting) == MOST_WAITING


def test_stamps_of_scans_are_kept_for_a_window():
    lidar = Revolutions()
    for k in range(2 * WINDOW):
        lidar.add(BEGIN_NS + k * 100_000_000, 0.1)
    assert len(lidar._stamps) == WINDOW


def test_names_of_other_joints_are_not_kept_for_ever():
    joint = JointInput(AssemblerConfig(), drops={})
    for k in range(1000):
        joint.samples(JointState(name=[f'{k}.{n}' for n in range(50)]))
    assert len(joint.missing_input) < 1000


def test_sweeps_that_no_scan_reaches_are_not_kept_for_ever():
    config, beam_period = AssemblerConfig(), 0.1 / 1024
    planned = Nod(-0.6, 0.6, 4001 * beam_period, 4001, BEGIN_NS)
    sweeps = ChosenSweeps(config.task, planned, 0.003, 2000)
    for k in range(2 * MOST_COMMANDED):
        sweeps._commanded.append((BEGIN_NS + k, planned))
    assert len(sweeps._commanded) == MOST_COMMANDED
