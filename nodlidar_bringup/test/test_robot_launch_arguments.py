"""The launch file's arguments: a second sensor, and what a wrong value leads to."""

import os
from pathlib import Path

from nodlidar_bringup.ros.launched import launched_sensor, STOP_TIMEOUT
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import time_ns
import numpy as np
from observer import Observer
import pytest
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import ReliabilityPolicy
from rclpy.time import Time
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from tf2_msgs.msg import TFMessage
import yaml


def parameters(observer, *names):
    """Return the values of the running assembler."""
    client = AsyncParameterClient(observer.node, 'assembler')
    observer.spin_until(client.services_are_ready, 'the assembler')
    answer = client.get_parameters(list(names))
    observer.spin_until(answer.done, 'parameters')
    return [parameter_value_to_python(value) for value in answer.result().values]


def test_two_sensors_run_side_by_side_under_their_namespaces(tmp_path):
    """With servos of both protocols, and the second one in two launches, as on two machines."""
    observer = Observer()
    sides = ('left', 'right')
    for side in sides:
        observer.subscribe(LaserScan, f'{side}/scan')
        observer.subscribe(JointState, f'{side}/joint_states')
        observer.subscribe(PointCloud2, f'{side}/points')
    arguments = {
        side: (f'namespace:=/{side}', f'frame_prefix:={side}_', 'scene:=wall', 'ideal:=true')
        for side in sides
    }
    right = (*arguments['right'], 'servo:=XL430-W250')
    with (
        launched_sensor(tmp_path / 'left.log', *arguments['left']),
        launched_sensor(tmp_path / 'right.log', *right, 'nodes:=devices'),
        launched_sensor(tmp_path / 'other.log', *right, 'nodes:=clouds'),
    ):
        # Each topic is found in its own time.
        topics = [
            f'{side}/{name}' for side in sides for name in ('scan', 'joint_states', 'points')
        ]
        heard = lambda: all(observer.messages[topic] for topic in topics)  # noqa: E731
        observer.spin_until(heard, 'all topics of both sensors')
        for side in sides:
            assert (
                observer.messages[f'{side}/points'][-1].header.frame_id
                == f'{side}_nodlidar_base_link'
            )
            assert observer.messages[f'{side}/scan'][-1].header.frame_id == f'{side}_laser'
            assert list(observer.messages[f'{side}/joint_states'][-1].name) == [
                f'{side}_nod_joint'
            ]
    observer.close()


def test_rviz_shows_clouds_where_they_do_not_move(tmp_path, monkeypatch):
    """By a program in place of RViz that writes its arguments down."""
    told = tmp_path / 'told'
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    program = tmp_path / 'lib' / 'rviz2' / 'rviz2'
    for folder in (index, program.parent):
        folder.mkdir(parents=True)
    (index / 'rviz2').touch()
    program.write_text(f'#!/bin/sh\necho "$@" >{told}.new && mv {told}.new {told}\n')
    program.chmod(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    with launched_sensor(tmp_path / 'launch.log', 'rviz:=true', 'ego_motion:=beam') as running:
        observer = Observer()
        observer.spin_until(lambda: told.exists() or not running.running(), 'RViz')
        observer.close()
    words = told.read_text().split()
    config = Path(words[words.index('-d') + 1])
    assert words[words.index('-f') + 1] == 'odom'
    view = yaml.safe_load(config.read_text())['Visualization Manager']['Views']['Current']
    assert view['Target Frame'] == 'base_link'


def test_a_profile_is_the_assembler_s_and_sets_the_rates_of_joint_states_and_tf(tmp_path):
    observer = Observer()
    observer.subscribe(TFMessage, '/tf')
    observer.subscribe(JointState, 'joint_states')
    observer.subscribe(PointCloud2, 'points')
    with launched_sensor(tmp_path / 'launch.log', 'profile:=fast', 'scene:=wall', 'ideal:=true'):
        heard = observer.messages['points'], observer.messages['joint_states']
        observer.spin_until(lambda: all(len(topic) > 40 for topic in heard), 'both topics')
        assert parameters(observer, 'profile', 'coverage_window') == ['fast', 0.0]
    stamps = [time_ns(state.header.stamp) for state in observer.messages['joint_states']]
    assert np.median(np.diff(stamps)) == pytest.approx(NS_PER_S / 16.0, rel=0.1)
    nods = [tf.transforms[0] for tf in observer.messages['/tf']]
    assert {nod.child_frame_id for nod in nods} == {'nodlidar_tilt_link'}
    # At most 10 Hz; robot_state_publisher takes the next joint state then.
    assert np.median(np.diff([time_ns(nod.header.stamp) for nod in nods])) > 0.09 * NS_PER_S
    observer.close()


def test_the_lidar_s_place_is_the_assembler_s_and_the_model_s(tmp_path):
    observer = Observer()
    mount = 'laser_xyz:=0.01 0 -5e-2', 'laser_rpy:=0 0 3.141592653589793'
    frames = 'nodlidar_tilt_link', 'laser', Time()
    with launched_sensor(tmp_path / 'launch.log', 'scene:=wall', 'ideal:=true', *mount):
        xyz, rpy = map(list, parameters(observer, 'laser_xyz', 'laser_rpy'))
        observer.spin_until(lambda: observer.transforms.can_transform(*frames), 'the model')
    assert (xyz, rpy) == ([0.01, 0.0, -0.05], [0.0, 0.0, np.pi])
    transform = observer.transforms.lookup_transform(*frames).transform
    p, q = transform.translation, transform.rotation
    assert [p.x, p.y, p.z] == pytest.approx(xyz)
    assert [q.x, q.y, q.z, q.w] == pytest.approx([0.0, 0.0, 1.0, 0.0])
    observer.close()


def test_the_assembler_plans_for_the_servo_unless_its_file_says_otherwise(tmp_path):
    file = tmp_path / 'assembler.yaml'
    file.write_text('/**: {ros__parameters: {max_nod_speed: 2.5}}\n')
    observer = Observer()
    arguments = 'scene:=wall', 'ideal:=true', 'servo:=XL430-W250', f'assembler_params:={file}'
    with launched_sensor(tmp_path / 'launch.log', *arguments):
        found = parameters(observer, 'max_nod_speed', 'max_nod_acceleration')
    assert found == pytest.approx([2.5, 150.0], rel=1e-3)
    observer.close()


def test_best_effort_scans_are_taken_in_a_namespace(tmp_path):
    observer = Observer()
    given = 'lidar:=ydlidar', 'servo:=none', 'description:=none', 'namespace:=/left/'
    with launched_sensor(tmp_path / 'launch.log', 'hardware:=real', *given):
        heard = lambda: observer.node.get_subscriptions_info_by_topic('/left/scan')  # noqa: E731
        observer.spin_until(heard, 'the assembler')
        qos = [each.qos_profile.reliability for each in heard()]
    assert qos == [ReliabilityPolicy.BEST_EFFORT]
    observer.close()


def ended(log, *arguments):
    """Return the log of a launch that ends by itself, with an exit status that says so."""
    with launched_sensor(log, *arguments) as running:
        assert running.process.wait(STOP_TIMEOUT) == 1
        return log.read_text()


@pytest.mark.parametrize(
    ('argument', 'words'),
    [
        ('laser_xyz:=0 0', "'laser_xyz' must be three numbers [m], separated by spaces"),
        ('rviz:=true', "package 'rviz2' is not installed"),
        ('hardware:=toy', 'Argument "hardware" provided value "toy" is not valid'),
    ],
)
def test_a_wrong_argument_is_named_in_one_line_before_anything_starts(tmp_path, argument, words):
    text = ended(tmp_path / 'launch.log', argument)
    line = [line for line in text.splitlines() if words in line][-1]
    assert '[ERROR] [launch]' in line
    assert 'process started' not in text
    assert 'Traceback' not in text


def test_contradictions_in_the_assembler_s_file_end_the_launch_before_anything_starts(tmp_path):
    file = tmp_path / 'assembler.yaml'
    file.write_text('/**: {ros__parameters: {pitch_min: 0.7, samples_per_sweeps: 4001}}\n')
    text = ended(tmp_path / 'launch.log', f'assembler_params:={file}')
    assert "'pitch_max' must be at least" in text
    assert text.count("there is no parameter 'samples_per_sweeps'") == 1
    assert 'process started' not in text
    assert 'Traceback' not in text
