"""A whole bag as arrays: by the conventions of the parameters, without malformed messages."""

from copy import deepcopy
from dataclasses import replace
import math

from bags import entries_of, recording, write_bag, write_messages
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.read_bag import read_bag, read_drive
from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.time_order import UNSTAMPED
import numpy as np
import pytest

CONFIG = AssemblerConfig()


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
    _, drops = assemble_log(log, AssemblerConfig())
    assert drops[reason] == log.drops[reason] == 1


def beside(entries, topic, kind, change):
    """Return entries, each of a topic also on another one, with other content."""
    others = [(at_ns, topic, change(m)) for at_ns, of, m in entries if of == kind]
    return sorted([*entries, *others], key=lambda entry: entry[0])


def test_another_lidar_and_joint_of_the_bag_do_not_count(simulated, tmp_path):
    entries = beside(
        entries_of(simulated), '/base_scan', '/scan', lambda m: replace(m, ranges=m.ranges + 1.0)
    )
    entries = beside(
        entries, '/arm', '/joint_states', lambda m: replace(m, position=m.position + 1.0)
    )
    bag = write_messages(tmp_path / 'bag', entries)
    expected = read_bag(write_messages(tmp_path / 'one', entries_of(simulated)), CONFIG)
    chosen = Topics()
    found = read_bag(bag, CONFIG, chosen)
    np.testing.assert_array_equal(found.sample_pitch, expected.sample_pitch)
    np.testing.assert_array_equal(
        [scan.ranges for scan in found.scans], [scan.ranges for scan in expected.scans]
    )
    other = read_bag(bag, CONFIG, replace(chosen, scan='/base_scan'))
    np.testing.assert_allclose(
        [scan.ranges for scan in other.scans], [scan.ranges + 1.0 for scan in expected.scans]
    )


def test_where_several_lidars_are_recorded_one_is_to_be_chosen(simulated, tmp_path):
    entries = [
        (at_ns, topic.replace('/scan', '/left/scan'), message)
        for at_ns, topic, message in entries_of(simulated)
    ]
    one = read_bag(write_messages(tmp_path / 'one', entries), CONFIG)
    assert len(one.scans) == len(simulated.scan_stamp_ns)
    entries = beside(entries, '/right/scan', '/left/scan', lambda m: m)
    bag = write_messages(tmp_path / 'bag', entries)
    with pytest.raises(BagError, match='on /left/scan, /right/scan: choose one with --scan'):
        read_bag(bag, CONFIG)
    assert len(read_bag(bag, CONFIG, Topics(scan='/right/scan')).scans) == len(one.scans)
    with pytest.raises(BagError, match='no topic /up/scan; it has'):
        read_bag(bag, CONFIG, Topics(scan='/up/scan'))


def test_what_of_a_drive_could_not_be_used_is_told(tmp_path):
    entries = entries_of(recording(1.0, velocity=(0.4, 0.5)))
    transforms = [entry for entry in entries if entry[1] == '/tf']
    unreadable = [(at_ns, '/tf', b'not a message') for at_ns, _, _ in transforms[:3]]
    for at_ns, _, message in transforms[5:7]:
        unstamped = deepcopy(message)
        for each in unstamped.transforms:
            each.header.stamp.sec = each.header.stamp.nanosec = 0
        unreadable.append((at_ns, '/tf', unstamped))
    spoilt = sorted([*entries, *unreadable], key=lambda entry: entry[0])
    whole = read_drive(write_messages(tmp_path / 'whole', entries), CONFIG)
    log = read_drive(write_messages(tmp_path / 'bag', spoilt), CONFIG)
    assert log.damage == ['3 on /tf could not be decoded']
    assert log.drops == {UNSTAMPED: 2}
    np.testing.assert_array_equal(log.odometry.time_ns, whole.odometry.time_ns)
    assert (whole.damage, whole.drops) == ([], {})


def test_if_all_are_malformed_the_error_says_what_is_wrong(simulated, tmp_path):
    bag = write_messages(tmp_path / 'bag', spoilt(entries_of(simulated), range(10)))
    with pytest.raises(BagError, match='has no scans: 10 angle_increment must be'):
        read_bag(bag, AssemblerConfig())
