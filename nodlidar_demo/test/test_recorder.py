"""The demo's bag: complete when all data has come, and readable without nodlidar_msgs."""

import json
from pathlib import Path
import time

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_common.ros.messages import time_message
from nodlidar_demo.delivery import read_start_ns
from nodlidar_demo.ros.recorder import LATCHED, Recorder, TOPICS
from nodlidar_msgs.msg import NodCommand
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer
from sensor_msgs.msg import JointState, LaserScan, PointCloud2, TimeReference
from std_msgs.msg import Header
import yaml

START_NS = 1_700_000_000_123_456_789
SENT = {
    'base/start': TimeReference(header=Header(stamp=time_message(START_NS))),
    'joint_states': JointState(name=['nod_joint'], position=[0.25]),
    'nod_command': NodCommand(pitch_min=-0.5, pitch_max=0.5, samples_per_sweep=4001),
    'points': PointCloud2(width=7),
    'scan': LaserScan(ranges=[1.0, 2.0]),
}


@pytest.fixture(scope='module')
def recorded(tmp_path_factory):
    """Publish topic by topic; return the bag, and after which topic it was complete."""
    bag = tmp_path_factory.mktemp('recorder') / 'bag'
    rclpy.init()
    recorder, source = Recorder(bag), Node('source')
    executor = SingleThreadedExecutor()
    executor.add_node(recorder)
    complete = {}
    for topic, message in SENT.items():
        qos = QoSProfile(depth=10)
        if topic in LATCHED:
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        publisher = source.create_publisher(type(message), topic, qos)
        spin_until(executor, lambda p=publisher: p.get_subscription_count() == 1)
        publisher.publish(message)
        spin_until(executor, lambda t=topic: recorder.counts[t] == 1)
        complete[topic] = recorder.complete()
    recorder.close()
    executor.shutdown()
    for node in (recorder, source):
        node.destroy_node()
    rclpy.shutdown()
    return bag, complete


def spin_until(executor, condition, timeout=20.0):
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline
        executor.spin_once(timeout_sec=0.1)


def test_the_assembler_is_asked_to_adapt_its_limits(tmp_path):
    rclpy.init()
    recorder, assembler = Recorder(tmp_path / 'bag'), Node('assembler')
    assembler.declare_parameter('adapt_limits', False)
    executor = SingleThreadedExecutor()
    for node in (recorder, assembler):
        executor.add_node(node)
    service = '/assembler/set_parameters'
    spin_until(executor, lambda: recorder.count_services(service) == 1)
    recorder.adapt_limits()
    spin_until(executor, lambda: assembler.get_parameter('adapt_limits').value)
    recorder.close()
    executor.shutdown()
    for node in (recorder, assembler):
        node.destroy_node()
    rclpy.shutdown()


def test_scans_are_recorded_though_their_publisher_is_not_reliable(tmp_path):
    rclpy.init()
    recorder, lidar = Recorder(tmp_path / 'bag', best_effort=True), Node('lidar')
    executor = SingleThreadedExecutor()
    executor.add_node(recorder)
    qos = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = lidar.create_publisher(LaserScan, 'scan', qos)
    lidar.create_timer(0.1, lambda: publisher.publish(LaserScan()))
    executor.add_node(lidar)
    spin_until(executor, lambda: recorder.counts['scan'] >= 1)
    recorder.close()
    executor.shutdown()
    for node in (recorder, lidar):
        node.destroy_node()
    rclpy.shutdown()


def test_it_is_complete_with_scans_joint_states_and_clouds_only(recorded):
    _, complete = recorded
    assert [topic for topic, done in complete.items() if done] == ['scan']


def test_its_messages_are_read_by_their_embedded_definitions(recorded):
    bag, _ = recorded
    with AnyReader([bag / 'bag.mcap']) as reader:  # the file alone, and no types given
        read = {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}
    assert set(read) == {f'/{topic}' for topic in SENT}
    command = read['/nod_command']
    assert (command.pitch_min, command.pitch_max, command.samples_per_sweep) == (-0.5, 0.5, 4001)
    assert read['/joint_states'].position.tolist() == [0.25]
    assert read['/scan'].ranges.tolist() == [1.0, 2.0]
    assert read['/points'].width == 7


def test_it_tells_when_the_simulation_began(recorded, tmp_path):
    bag, _ = recorded
    assert read_start_ns(bag) == START_NS
    with Writer(tmp_path / 'empty', version=9):
        pass
    with pytest.raises(BagError, match='lacks the start of the simulation'):
        read_start_ns(tmp_path / 'empty')


def test_its_metadata_names_the_types_that_ros_has(recorded):
    bag, _ = recorded
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert metadata['message_count'] == len(SENT)
    for topic in metadata['topics_with_message_count']:
        package, _, name = topic['topic_metadata']['type'].split('/')
        share = Path(get_package_share_directory(package))
        hashes = json.loads((share / 'msg' / f'{name}.json').read_text())['type_hashes']
        known = {entry['type_name']: entry['hash_string'] for entry in hashes}
        assert topic['topic_metadata']['type_description_hash'] == known[f'{package}/msg/{name}']


def test_it_is_played_back_as_it_was_offered(recorded):
    bag, _ = recorded
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    topics = {
        topic['topic_metadata']['name']: topic['topic_metadata']['offered_qos_profiles'][0]
        for topic in metadata['topics_with_message_count']
    }
    assert set(topics) == {topic if topic[0] == '/' else f'/{topic}' for topic in TOPICS}
    for name, qos in topics.items():
        latched = name in ('/base/start', '/tf_static')
        assert qos['durability'] == ('transient_local' if latched else 'volatile')
        assert (qos['reliability'], qos['history']) == ('reliable', 'keep_last')
        # rosbag2's RMW_DURATION_INFINITE
        assert qos['deadline'] == qos['lifespan'] == {'sec': 9223372036, 'nsec': 854775807}
