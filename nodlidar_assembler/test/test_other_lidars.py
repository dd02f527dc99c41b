"""Recordings in the conventions of other tilting lidars, as README.md has them."""

import subprocess
import sys

from bags import entries_of, recording, write_bag
from nodlidar_assembler.commands.entry_points import assemble_bag
from nodlidar_common.stamps import time_ns
import numpy as np
from plyfile import PlyData
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS1_NOETIC)
TYPES = STORE.types
SCAN, JOINT_STATE = 'sensor_msgs/msg/LaserScan', 'sensor_msgs/msg/JointState'
PARAMETERS = """
/**:
  ros__parameters:
    joint_name: laser_tilt_mount_joint
    joint_positive: down
    joint_zero: 0.3
    laser_rpy: [3.141592653589793, 0.0, 0.0]
"""


@pytest.fixture(scope='module')
def simulated():
    return recording(3.0)


def header(message):
    seconds, nanoseconds = divmod(time_ns(message.header.stamp), 10**9)
    stamp = TYPES['builtin_interfaces/msg/Time'](seconds, nanoseconds)
    return TYPES['std_msgs/msg/Header'](0, stamp, message.header.frame_id)


def joint_state(message, names, positions):
    nothing = np.zeros(0)
    return TYPES[JOINT_STATE](header(message), names, np.array(positions), nothing, nothing)


def upside_down(message):
    """Return what the same lidar tells of the same beams when it hangs by its base."""
    return TYPES[SCAN](
        header(message),
        -message.angle_min,
        -message.angle_max,
        -message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
        message.ranges,
        message.intensities,
    )


def as_of_another_robot(simulated):
    """Yield (time [ns], topic, type, message) of a tilting lidar on a robot with other joints."""
    for time_ns_, topic, message in entries_of(simulated):
        if topic == '/scan':
            yield time_ns_, '/tilt_scan', SCAN, upside_down(message)
        elif topic == '/joint_states':
            names = ['torso_lift_joint', 'laser_tilt_mount_joint', 'head_pan_joint']
            positions = [0.1, 0.3 - message.position[0], -1.0]
            yield time_ns_, '/r/joints', JOINT_STATE, joint_state(message, names, positions)
            wheels = joint_state(message, ['left_wheel', 'right_wheel'], [5.0, 6.0])
            yield time_ns_, '/r/joints', JOINT_STATE, wheels


def ros_1_bag(simulated, path):
    with Writer(path) as writer:
        connections = {}
        for recorded_ns, topic, kind, message in as_of_another_robot(simulated):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            raw = STORE.serialize_ros1(message, kind)
            writer.write(connections[topic], recorded_ns, raw)


def points_of(bag, *options):
    output = bag.with_suffix('.ply')
    assert assemble_bag([str(bag), str(output), *map(str, options)]) == 0
    return PlyData.read(output)['vertex'].data


def test_a_bag_of_ros_1_with_a_hanging_lidar_that_tilts_down(simulated, tmp_path):
    write_bag(simulated, tmp_path / 'own')
    expected = points_of(tmp_path / 'own')
    ros_1_bag(simulated, tmp_path / 'other.bag')
    converted = tmp_path / 'converted'
    convert = sys.executable, '-m', 'rosbags.convert'  # which is what rosbags-convert runs
    subprocess.run([*convert, '--src', tmp_path / 'other.bag', '--dst', converted], check=True)
    (tmp_path / 'lidar.yaml').write_text(PARAMETERS)
    found = points_of(converted, '--params', tmp_path / 'lidar.yaml')
    assert len(found) == len(expected) > 20_000
    for axis in 'xyz':
        np.testing.assert_allclose(found[axis], expected[axis], atol=1e-5)
    for name in ('intensity', 'time', 'ring'):
        np.testing.assert_array_equal(found[name], expected[name])
