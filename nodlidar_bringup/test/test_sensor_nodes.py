"""Which nodes a launch starts: their executables, none of which runs."""

import math
from pathlib import Path

from launch import LaunchContext
from nodlidar_bringup.ros import sensor
from nodlidar_bringup.ros.launch_arguments import ARGUMENTS
import pytest

MINE = 'a file of the user'


def sensor_of(**arguments):
    context = LaunchContext()
    defaults = {name: options['default_value'] for name, options in ARGUMENTS.items()}
    context.launch_configurations.update(defaults | arguments)
    return sensor.Sensor(context)


@pytest.fixture
def executables(monkeypatch):
    """Return a function from arguments to the executables of the nodes."""
    monkeypatch.setattr(sensor, 'tied_node', lambda _, package, executable, **options: executable)
    return lambda **arguments: sensor_of(**arguments).nodes()


@pytest.mark.parametrize(
    ('servo', 'nodes'),
    [
        ('', ['driver', 'servo', 'robot_state_publisher', 'assembler']),
        ('XL430-W250', ['driver', 'servo', 'robot_state_publisher', 'assembler']),
        ('trajectory', ['driver', 'joint_trajectory', 'robot_state_publisher', 'assembler']),
        ('none', ['driver', 'robot_state_publisher', 'assembler']),
    ],
)
def test_the_servo_node_starts_unless_the_joint_is_left_to_others(executables, servo, nodes):
    assert executables(hardware='real', servo=servo) == nodes


@pytest.mark.parametrize('hardware', ['sim', 'real'])
def test_two_machines_share_the_nodes(executables, hardware):
    given = {'hardware': hardware, 'view': 'web'}
    there, here = (executables(nodes=nodes, **given) for nodes in ('devices', 'clouds'))
    emulators = ['emulate'] if hardware == 'sim' else []
    assert there == [*emulators, 'driver', 'servo', 'robot_state_publisher']
    assert here == ['assembler', 'viewer']
    assert sorted(there + here) == sorted(executables(**given))


def test_a_robot_whose_description_has_the_sensor_publishes_it_itself(executables):
    nodes = executables(hardware='real', servo='trajectory', description='none')
    assert nodes == ['driver', 'joint_trajectory', 'assembler']


@pytest.mark.parametrize('lidar', ['none', 'rplidar'])
def test_the_driver_starts_unless_another_one_publishes_scans(executables, lidar):
    nodes = executables(hardware='real', lidar=lidar)
    assert nodes == ['servo', 'robot_state_publisher', 'assembler']


@pytest.mark.parametrize(
    ('given', 'base'),
    [
        ({}, 'route'),
        ({'profile': 'slam'}, 'odometry'),
        ({'profile': 'slam', 'ego_motion': 'off'}, 'route'),
        ({'ego_motion': 'beam'}, 'odometry'),
        ({'ego_motion': 'beam', 'base': 'route'}, 'route'),
    ],
)
def test_a_simulated_base_publishes_the_odometry_that_clouds_need(monkeypatch, given, base):
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options['arguments'])
    said = sensor_of(**given).emulators()
    assert said[said.index('--base') + 1] == base


def test_the_assembler_is_told_how_the_sensor_is_mounted(monkeypatch):
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options['arguments'])
    said = sensor_of(mount_xyz='0.2 0 0.4', mount_rpy='3.14159265 0.25 1').assembler()
    assert 'mount_tilt:=[3.14159265, 0.25]' in said
    height = next(word for word in said if word.startswith('sensor_height:='))
    assert float(height.partition('=')[2]) == pytest.approx(0.4 - 0.08 * math.cos(0.25))


def test_the_assembler_s_file_takes_precedence_over_that_of_a_driver(monkeypatch):
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options['parameters'])
    chosen = {'hardware': 'real', 'lidar': 'ldlidar', 'adapt_limits': 'true'}
    *files, own = sensor_of(**chosen).assembler()
    names = [Path(file).name for file in files]
    assert names == ['balanced.yaml', 'ldlidar.yaml', 'assembler.yaml']
    assert 'last_beam_first' not in own
    assert own['adapt_limits'] is True


@pytest.mark.parametrize(
    ('given', 'executable', 'file'),
    [
        ({}, 'driver', 'driver.yaml'),
        ({'lidar': 'UST-10LX'}, 'driver', 'driver.yaml'),
        ({'lidar': 'LD19'}, 'ldrobot', 'ldrobot.yaml'),
        ({'lidar': 'LD19', 'driver_params': MINE}, 'ldrobot', 'mine.yaml'),
    ],
)
@pytest.mark.parametrize('hardware', ['sim', 'real'])
def test_each_lidar_has_its_driver_and_its_file(
    monkeypatch, tmp_path, given, executable, file, hardware
):
    monkeypatch.setattr(sensor, 'tied_node', lambda *args, **options: (args[2], options))
    path = tmp_path / 'mine.yaml'
    path.write_text('/**:\n  ros__parameters:\n    timeout: 0.5\n')
    given = {name: str(path) if value == MINE else value for name, value in given.items()}
    started, options = sensor_of(hardware=hardware, **given).driver()
    assert (started, options['name']) == (executable, 'driver')
    assert Path(options['parameters'][0]).name == file


def test_an_ld19_is_started_with_real_devices_too(monkeypatch):
    monkeypatch.setattr(sensor, 'tied_node', lambda *args, **_: args[2])
    assert 'ldrobot' in sensor_of(hardware='real', lidar='LD19').nodes()
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options['parameters'])
    *files, _ = sensor_of(hardware='real', lidar='LD19').assembler()
    assert [Path(file).name for file in files] == ['balanced.yaml', 'LD19.yaml', 'assembler.yaml']


@pytest.mark.parametrize(
    ('pushed', 'own', 'topic'),
    [
        ('', '', '/scan'),
        ('', 'left', '/left/scan'),
        ('/', 'left', '/left/scan'),
        ('/robot', '', '/robot/scan'),
        ('/robot', 'left', '/robot/left/scan'),
        ('/robot', '/left', '/left/scan'),
    ],
)
def test_best_effort_scans_come_in_within_a_namespace_that_is_pushed(
    monkeypatch, pushed, own, topic
):
    """By PushRosNamespace in a launch file that includes this one, as launch_ros combines them."""
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options)
    given = {'hardware': 'real', 'lidar': 'ydlidar', 'namespace': own, 'ros_namespace': pushed}
    node = sensor_of(**given).assembler()
    assert f'qos_overrides.{topic}.subscription.reliability' in node['parameters'][-1]
    assert node['namespace'].strip('/') == topic.removesuffix('scan').strip('/')


def test_a_namespace_that_is_pushed_is_one_for_own_transforms(executables):
    assert executables(hardware='real', own_tf='true', ros_namespace='/robot')
