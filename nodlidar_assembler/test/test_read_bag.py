"""A whole bag as arrays: by the conventions of the parameters, without malformed messages."""

from dataclasses import replace
import math

from bags import entries_of, recording, write_bag, write_messages
from nodlidar_assembler.bags.bag_types import BagError
from nodlidar_assembler.bags.read_bag import read_bag
from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.clouds.pipeline import Pipeline
from nodlidar_assembler.config import AssemblerConfig
import numpy as np
import pytest


@pytest.fixture(scope='module')
def simulated():
    return recording(1.0)


def test_it_is_read_by_the_conventions_of_the_parameters(simulated, tmp_path):
    write_bag(simulated, tmp_path / 'bag')
    config = AssemblerConfig(
        joint_positive='down', joint_zero=0.25, joint_delay=0.01, scan_delay=0.02
    )
    log = read_bag(tmp_path / 'bag', config)
    np.testing.assert_array_equal(log.sample_ns, simulated.joint_stamp_ns - 10_000_000)
    np.testing.assert_allclose(log.sample_pitch, 0.25 - simulated.joint_position, atol=1e-12)
    stamps_ns = [scan.stamp_ns for scan in log.scans]
    np.testing.assert_array_equal(stamps_ns, simulated.scan_stamp_ns - 20_000_000)


def spoilt(entries, wrong):
    """Return entries whose scans of some numbers have no angle_increment."""
    scans = [entry for entry in entries if entry[1] == '/scan']
    bad = {id(scans[number]) for number in wrong}
    return [
        (at_ns, topic, replace(message, angle_increment=math.inf)) if id(entry) in bad else entry
        for entry in entries
        for at_ns, topic, message in [entry]
    ]


def test_a_malformed_scan_is_left_out(simulated, tmp_path):
    bag = write_messages(tmp_path / 'bag', spoilt(entries_of(simulated), [3]))
    log = read_bag(bag, AssemblerConfig())
    expected = np.delete(simulated.scan_stamp_ns, 3)
    np.testing.assert_array_equal([scan.stamp_ns for scan in log.scans], expected)
    (reason,) = log.drops
    assert reason.startswith('angle_increment must be')
    _, drops = assemble_log(log, Pipeline(AssemblerConfig()))
    assert drops[reason] == log.drops[reason] == 1


def test_if_all_are_malformed_the_error_says_what_is_wrong(simulated, tmp_path):
    bag = write_messages(tmp_path / 'bag', spoilt(entries_of(simulated), range(10)))
    with pytest.raises(BagError, match='has no scans: 10 angle_increment must be'):
        read_bag(bag, AssemblerConfig())
