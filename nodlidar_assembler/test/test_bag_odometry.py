"""Odometry from a bag that rosbags wrote, without ROS."""

from dataclasses import replace
import math

from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.read_bag import with_odometry
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.config import AssemblerConfig
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
S = 1_000_000_000
START = 1_700_000_000
HALF = math.sqrt(0.5)
NOTHING = SensorLog([], np.array([], np.int64), np.array([]))


def read_odometry(*of):
    return with_odometry(NOTHING, *of).odometry


def message(entries):
    """Make a TFMessage of (second after START, parent, child, xyz, xyzw)."""
    types = STORE.types

    def of(kind, *values):
        return types[kind](*values)

    stamped = [
        of(
            'geometry_msgs/msg/TransformStamped',
            of(
                'std_msgs/msg/Header',
                of('builtin_interfaces/msg/Time', START + int(second), round(second % 1 * S)),
                parent,
            ),
            child,
            of(
                'geometry_msgs/msg/Transform',
                of('geometry_msgs/msg/Vector3', *xyz),
                of('geometry_msgs/msg/Quaternion', *xyzw),
            ),
        )
        for second, parent, child, xyz, xyzw in entries
    ]
    return of('tf2_msgs/msg/TFMessage', stamped)


@pytest.fixture
def bag(tmp_path):
    """Return a function that writes a bag of moving and fixed transforms."""

    def write(moving, fixed):
        path = tmp_path / 'bag'
        with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for topic, messages in (('/tf', moving), ('/tf_static', fixed)):
                kind = 'tf2_msgs/msg/TFMessage'
                connection = writer.add_connection(topic, kind, typestore=STORE)
                for k, entries in enumerate(messages):
                    raw = STORE.serialize_cdr(message(entries), kind)
                    writer.write(connection, START * S + k, raw)
        return path

    return write


OF_PIVOT = AssemblerConfig(odom_frame='odom', frame_id='pivot')
UNTURNED, LEFT = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, HALF, HALF)
FIXED = [
    [(0, 'base_link', 'mast', (0.2, 0.0, 1.0), UNTURNED)],
    [(0, 'mast', 'pivot', (0.0, 0.0, 0.1), LEFT)],
]


def test_moving_transforms_and_the_fixed_ones_up_to_the_frame(bag):
    moving = [
        [(0.5, 'odom', 'base_link', (1.0, 2.0, 0.0), UNTURNED)],
        [(0.0, 'map', 'odom', (9.0, 9.0, 9.0), UNTURNED)],
        [
            (0.25, 'odom', 'base_link', (0.0, 0.0, 0.0), UNTURNED),
            (0.75, 'odom', 'base_link', (3.0, 4.0, 0.0), LEFT),
        ],
        [(0.5, 'odom', 'base_link', (1.0, 2.5, 0.0), UNTURNED)],
    ]
    odometry = read_odometry(bag(moving, FIXED), OF_PIVOT)
    assert list(odometry.time_ns - START * S) == [S // 4, S // 2, 3 * S // 4]
    expected = [(0.2, 0.0, 1.1), (1.2, 2.0, 1.1), (3.0, 4.2, 1.1)]
    np.testing.assert_allclose(odometry.poses.position, expected, atol=1e-12)
    turned = [LEFT, LEFT, (0.0, 0.0, 1.0, 0.0)]
    np.testing.assert_allclose(odometry.poses.orientation, turned, atol=1e-12)


def test_a_frame_that_moves_itself(bag):
    moving = [[(t, 'odom', 'pivot', (t, 0.0, 0.0), UNTURNED)] for t in (0.0, 0.5)]
    odometry = read_odometry(bag(moving, []), OF_PIVOT)
    np.testing.assert_allclose(odometry.poses.position[:, 0], [0.0, 0.5])


def test_of_several_topics_of_transforms_one_can_be_chosen(bag):
    moving = [[(0.0, 'odom', 'pivot', (t, 0.0, 0.0), UNTURNED)] for t in (0.5, 1.0)]
    path = bag(moving, [])
    assert read_odometry(path, OF_PIVOT, Topics(tf='/tf')).poses.position[0, 0] == 0.5
    with pytest.raises(BagError, match='no topic /left/tf; it has /tf '):
        read_odometry(path, OF_PIVOT, Topics(tf='/left/tf'))


def test_transforms_without_a_stamp_are_left_out(bag):
    stamps = [0.5, *[-START] * 3, 1.0]
    moving = [[(t, 'odom', 'pivot', (k, 0.0, 0.0), UNTURNED)] for k, t in enumerate(stamps)]
    odometry = read_odometry(bag(moving, []), OF_PIVOT)
    np.testing.assert_allclose(odometry.poses.position[:, 0], [0.0, 4.0])


def test_the_delay_of_its_stamps_is_taken_out(bag):
    moving = [[(t, 'odom', 'pivot', (t, 0.0, 0.0), UNTURNED)] for t in (0.5, 1.0)]
    odometry = read_odometry(bag(moving, []), replace(OF_PIVOT, odometry_delay=0.25))
    assert list(odometry.time_ns - START * S) == [S // 4, 3 * S // 4]
    np.testing.assert_allclose(odometry.poses.position[:, 0], [0.5, 1.0])


def test_stamps_that_jitter_are_evened_by_their_period(bag):
    stamps = [0.0, 0.13, 0.19, 0.34, 0.4]
    moving = [[(t, 'odom', 'pivot', (k, 0.0, 0.0), UNTURNED)] for k, t in enumerate(stamps)]
    odometry = read_odometry(bag(moving, []), replace(OF_PIVOT, odometry_period=0.1))
    assert list(odometry.time_ns - START * S) == [S // 10 * k for k in range(len(stamps))]


@pytest.mark.parametrize('moving', [[], [[(0, 'world', 'base_link', (0.0, 0.0, 0.0), UNTURNED)]]])
def test_a_bag_without_odometry_is_refused(bag, moving):
    with pytest.raises(BagError, match=r"no transform from 'odom' to '(base_link|world)'"):
        read_odometry(bag(moving, FIXED), OF_PIVOT)


@pytest.mark.parametrize('length', [0.9951, 1.0049])
def test_quaternions_of_another_length_within_the_tolerance_of_tf2_are_normalised(bag, length):
    left = tuple(length * each for each in LEFT)
    moving = [[(k, 'odom', 'base_link', (k, 0.0, 0.0), left if k == 1 else LEFT)] for k in (0, 1)]
    fixed = [[(0, 'base_link', 'pivot', (0.2, 0.0, 1.0), left)]]
    odometry = read_odometry(bag(moving, fixed), OF_PIVOT)
    np.testing.assert_allclose(odometry.poses.position[1], (1.0, 0.2, 1.0), atol=1e-12)
    np.testing.assert_allclose(odometry.poses.orientation[1], (0.0, 0.0, 1.0, 0.0), atol=1e-12)


def test_a_fixed_transform_that_is_nowhere_is_refused(bag):
    fixed = [[(0, 'base_link', 'pivot', (0.0, math.inf, 0.0), UNTURNED)]]
    with pytest.raises(BagError, match=r'position \[ 0. inf  0.\]'):
        read_odometry(bag([], fixed), OF_PIVOT)


def test_a_fixed_transform_that_is_no_rotation_is_refused(bag):
    fixed = [[(0, 'base_link', 'pivot', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))]]
    with pytest.raises(BagError, match='quaternion of the length 0'):
        read_odometry(bag([], fixed), OF_PIVOT)
