"""The same messages, some of them bad, to the running node and from a bag: the same clouds."""

import math

from bags import entries_of, recording, START_NS, write_messages
from node_bench import bench
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import STORE
from nodlidar_sim.bag import TOPICS
import pytest
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState, LaserScan, PointCloud2

KINDS = {'/scan': LaserScan, '/joint_states': JointState}
DEADLINE = 10.0  # longer than the test: the node's clock is none that a bag knows


@pytest.fixture(scope='module')
def entries():
    """Return messages, some joint states missing at first and in the middle, some malformed."""
    recorded = [entry for entry in entries_of(recording(3.0)) if entry[1] in KINDS]
    kept = [entry for entry in recorded if entry[1] == '/scan' or not is_missing(entry[0])]
    scans, states = (
        [message for _, topic, message in kept if topic == wanted] for wanted in KINDS
    )
    scans[5].angle_increment = math.nan
    scans[8].header.stamp.sec = -1
    states[60].position[0] = math.nan
    return kept


def is_missing(time_ns):
    seconds = (time_ns - START_NS) / 1e9
    return seconds < 0.05 or 1.5 < seconds < 1.8


def clouds_of_node(entries, expected, cloud_mode, sigma_field):
    """Return the clouds that the node publishes of messages, and what it drops."""
    options = {'deadline': DEADLINE, 'cloud_mode': cloud_mode, 'sigma_field': sigma_field}
    with bench(*(f'{key}:={value}' for key, value in options.items())) as running:
        publishers = {'/scan': running.scans, '/joint_states': running.states}
        for _, topic, message in entries:
            raw = bytes(STORE.serialize_cdr(message, TOPICS[topic]))
            running.send(publishers[topic], deserialize_message(raw, KINDS[topic]))
        clouds, drops = running.out[PointCloud2], running.node.assembly.assembler.drops
        running.spin_until(lambda: len(clouds) >= len(expected.clouds))
        running.spin_until(lambda: drops.total() >= expected.drops.total())
        return [(c.header.stamp, names_in(c), bytes(c.data)) for c in clouds], dict(drops)


def names_in(cloud):
    return [field.name for field in cloud.fields]


class Expected:
    """The clouds of a bag, and what was dropped but for what still waits in the node."""

    def __init__(self, path, drops, cloud_mode):
        with AnyReader([path]) as reader:
            messages = [
                reader.deserialize(raw, kind.msgtype) for kind, _, raw in reader.messages()
            ]
        self.clouds = [(m.header.stamp, names_in(m), bytes(m.data)) for m in messages]
        if cloud_mode == 'sweep':  # the node waits for the end of the last one
            self.clouds.pop()
        self.drops = drops.copy()
        del self.drops['no joint state after it before the deadline']


@pytest.mark.parametrize(('cloud_mode', 'sigma_field'), [('scan', False), ('sweep', True)])
def test_a_bag_gives_the_clouds_and_drops_of_the_node(entries, tmp_path, cloud_mode, sigma_field):
    bag = write_messages(tmp_path / 'bag', entries)
    config = AssemblerConfig(deadline=DEADLINE, cloud_mode=cloud_mode, sigma_field=sigma_field)
    summary = write_clouds(bag, tmp_path / 'out.mcap', config, Topics())
    expected = Expected(tmp_path / 'out.mcap', summary.assembler.drops, cloud_mode)
    assert len(expected.drops) == 5
    clouds, drops = clouds_of_node(entries, expected, cloud_mode, sigma_field)
    assert drops == dict(expected.drops)
    assert len(clouds) == len(expected.clouds) > 2
    for (stamp, names, data), (expected_stamp, expected_names, expected_data) in zip(
        clouds, expected.clouds, strict=True
    ):
        assert names == expected_names
        assert ('sigma' in names) == sigma_field
        assert (stamp.sec, stamp.nanosec) == (expected_stamp.sec, expected_stamp.nanosec)
        assert data == expected_data
