"""The table of topics in docs/network.md says what the endpoints of live nodes report."""

from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_driver.ros.scip_node import ScipNode
from nodlidar_mapper.ros.node import MapperNode
from nodlidar_servo.ros.node import ServoNode
import pytest
import rclpy
from sensor_msgs.msg import PointCloud2

from bench.network.bandwidth import message_type, offered
from bench.shared.report import recorded

NODES = {'driver', 'servo', 'assembler', 'mapper'}


@pytest.fixture(scope='module')
def node():
    """Return one of all nodes in one process, which know of each other at once."""
    given = ['-p', 'ego_motion:=beam', '-p', 'level_scan:=sweep']
    rclpy.init(args=['--ros-args', *given])
    nodes = [make() for make in (ScipNode, ServoNode, AssemblerNode, MapperNode)]
    for device in nodes[:2]:
        device.trigger_configure()  # from then on it publishes diagnostics
    yield nodes[0]
    for each in nodes:
        each.destroy_node()
    rclpy.shutdown()


def rows():
    """Return the recorded rows of topics that only these nodes publish."""
    found = {row['topic']: row for row in recorded('bandwidth')['rows']}
    return [row for row in found.values() if set(row['from'].split(', ')) <= NODES]


@pytest.mark.parametrize('row', rows(), ids=lambda row: row['topic'])
def test_the_recorded_qos_is_that_of_the_code(node, row):
    said = {key: row[key] for key in ('reliability', 'durability')}
    publishers = node.get_publishers_info_by_topic(row['topic'])
    assert {each.node_name for each in publishers} == set(row['from'].split(', '))
    assert offered(publishers) == said


def test_every_topic_of_the_nodes_is_recorded(node):
    known = {row['topic'] for row in recorded('bandwidth')['rows']}
    own = {
        topic
        for topic, _ in node.get_topic_names_and_types()
        if '/_action/' not in topic
        and {each.node_name for each in node.get_publishers_info_by_topic(topic)} & NODES
    }
    assert {'/scan', '/joint_states', '/points', '/nod_command', '/map'} <= own
    assert own - known <= {'/parameter_events', '/rosout', '/tf', '/tf_static'}


def test_a_type_is_found_by_its_name():
    assert message_type('sensor_msgs/msg/PointCloud2') is PointCloud2
