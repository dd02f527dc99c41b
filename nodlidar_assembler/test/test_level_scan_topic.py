"""Level scans as messages: of the running node, and of `assemble_bag` with the same recording."""

from bags import entries_of, recording, write_bag
from node_bench import bench
from nodlidar_assembler.assemble_bag import main
from nodlidar_assembler.bags.bag_clouds import write_clouds
from nodlidar_assembler.bags.bag_types import Topics
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.stamps import time_ns
from nodlidar_sim.bag import STORE, TOPICS
import numpy as np
import pytest
from rclpy.qos import qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState, LaserScan

KINDS = {'/scan': LaserScan, '/joint_states': JointState}
SHAPE = ('angle_min', 'angle_max', 'angle_increment', 'time_increment', 'scan_time')
RANGE = ('range_min', 'range_max')


@pytest.fixture(scope='module')
def simulated():
    return recording(2.5)


@pytest.fixture(params=['sweep', 'scan'])
def of_bag(request, simulated, tmp_path):
    """Return the mode, and the level scans that assemble_bag writes."""
    write_bag(simulated, tmp_path / 'bag')
    output = tmp_path / 'out.mcap'
    assert main([str(tmp_path / 'bag'), str(output), '--level-scan', request.param]) == 0
    with AnyReader([output]) as reader:
        return request.param, [
            reader.deserialize(raw, kind.msgtype)
            for kind, _, raw in reader.messages()
            if kind.topic == '/level_scan'
        ]


def test_the_node_publishes_the_level_scans_of_the_bag(simulated, of_bag):
    mode, expected = of_bag
    assert len(expected) >= (4 if mode == 'sweep' else 12)
    found = []
    with bench(f'level_scan:={mode}', 'deadline:=10.0', 'command_nod:=false') as running:
        running.feeder.create_subscription(
            LaserScan, 'level_scan', found.append, qos_profile_sensor_data
        )
        [topic] = [p for p in running.node.publishers if p.topic_name == '/level_scan']
        running.spin_until_heard(topic)
        for _, name, message in entries_of(simulated):
            if name in KINDS:
                raw = bytes(STORE.serialize_cdr(message, TOPICS[name]))
                publisher = running.scans if name == '/scan' else running.states
                running.send(publisher, deserialize_message(raw, KINDS[name]))
        running.spin_until(lambda: len(found) >= len(expected))
    for one, other in zip(found, expected, strict=True):
        assert time_ns(one.header.stamp) == time_ns(other.header.stamp)
        assert one.header.frame_id == other.header.frame_id == 'nodlidar_base_link'
        for key in SHAPE + RANGE:
            assert getattr(one, key) == pytest.approx(getattr(other, key))
        np.testing.assert_array_equal(one.ranges, other.ranges)


def test_a_level_scan_has_as_many_beams_as_its_angles_say(of_bag):
    """As slam_toolbox counts them, by whose count a scan is refused."""
    for scan in of_bag[1]:
        beams = round((scan.angle_max - scan.angle_min) / scan.angle_increment) + 1
        assert beams == len(scan.ranges) == LevelScanConfig().level_scan_beams
        seen = scan.ranges[np.isfinite(scan.ranges)]
        assert len(seen)
        assert (seen <= scan.range_max).all()


def test_a_file_that_holds_no_level_scans_says_so(simulated, tmp_path):
    write_bag(simulated, tmp_path / 'bag')
    config = AssemblerConfig(level_scan='sweep')
    summary = write_clouds(tmp_path / 'bag', tmp_path / 'out.ply', config, Topics())
    assert any('level scans are left out' in note for note in summary.notes)
    assert 'level scans' not in summary.counts
