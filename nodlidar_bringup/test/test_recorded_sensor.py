"""The launch file of the mapper with a bag in place of the devices, as far as `ros2 bag`.

`ros2 bag` is on no registry that the tests can use; its options are those of Jazzy's
ros2bag/verb/play.py: `--clock [HZ]`, `--topics TOPIC ...` and `--remap OLD:=NEW ...`.
"""

from importlib.util import module_from_spec, spec_from_file_location
import os
from pathlib import Path
import sys

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription, LaunchService
from launch_ros.actions import Node
from nodlidar_bringup.ros.recorded_sensor import RecordedSensor
from nodlidar_common.errors import NodlidarError
from nodlidar_mapper.output.saved_map import KEYFRAMES
import pytest


def launched(**given):
    """Return the launch context with arguments, and what the launch file starts."""
    path = Path(get_package_share_directory('nodlidar_bringup')) / 'launch' / 'mapping.launch.py'
    spec = spec_from_file_location('mapping_launch', path)
    file = module_from_spec(spec)
    spec.loader.exec_module(file)
    *declared, nodes = file.generate_launch_description().entities
    context = LaunchContext()
    context.launch_configurations.update(given)
    for argument in declared:
        argument.visit(context)
    return context, nodes.visit(context)


@pytest.fixture
def bag_command(tmp_path, monkeypatch):
    """Let it seem that `ros2 bag` is installed, and that there is a bag 'drive'."""
    (tmp_path / 'drive').mkdir()
    monkeypatch.chdir(tmp_path)
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'ros2bag').touch()
    (tmp_path / 'share' / 'ros2bag').mkdir()
    paths = [str(tmp_path), os.environ.get('AMENT_PREFIX_PATH', '')]
    monkeypatch.setenv('AMENT_PREFIX_PATH', os.pathsep.join(paths))


def test_a_bag_takes_the_place_of_the_devices(bag_command):
    context, started = launched(bag='drive', namespace='left')
    assert [type(action) is Node for action in started] == [False, True, True]
    words = RecordedSensor(context).player()
    assert words[:4] == ['ros2', 'bag', 'play', 'drive']
    topics = ['/left/scan', '/left/joint_states', '/tf', '/tf_static']
    assert words[words.index('--topics') + 1 :] == topics


@pytest.mark.parametrize(('status', 'ends'), [(0, False), (1, True)])
def test_a_bag_that_cannot_be_played_ends_the_launch(bag_command, status, ends):
    command = [sys.executable, '-c', f'import sys; sys.exit({status})']
    context, _ = launched(bag='drive')
    recorded = RecordedSensor(context)
    recorded.player = lambda: command
    player, *_ = recorded.nodes()
    service = LaunchService(noninteractive=True)
    service.include_launch_description(LaunchDescription([player]))
    assert service.run() == int(ends)


def test_the_map_is_on_the_machine_of_the_mapper():
    missing = {'map': '/no/such/folder', 'mapper_params': '/no/such/file'}
    _, started = launched(nodes='devices', **missing)
    assert len(started) == 4
    with pytest.raises(NodlidarError, match="'map' must be"):
        launched(nodes='clouds', **missing)


def test_a_bag_is_assembled_on_the_machine_that_plays_it(bag_command):
    with pytest.raises(NodlidarError, match="'nodes' must be all with a bag"):
        launched(bag='drive', nodes='clouds')


def test_with_own_tf_the_transforms_are_played_in_the_namespace(bag_command):
    context, _ = launched(bag='drive', namespace='left', own_tf='true')
    words = RecordedSensor(context).player()
    topics, remaps = words.index('--topics'), words.index('--remap')
    played = ['/left/scan', '/left/joint_states', '/tf', '/tf_static', '/left/tf']
    assert words[topics + 1 : remaps] == [*played, '/left/tf_static']
    assert words[remaps + 1 :] == ['/tf:=/left/tf', '/tf_static:=/left/tf_static']


@pytest.mark.parametrize(
    ('name', 'value'), [('ego_motion', 'beam'), ('profile', 'balanced'), ('profile', 'fast')]
)
@pytest.mark.parametrize('bag', ['', 'drive'])
def test_clouds_that_the_mapper_cannot_use_are_refused(bag_command, bag, name, value):
    with pytest.raises(NodlidarError, match=f"'{name}' must be .* with the mapper.*'{value}'"):
        launched(bag=bag, **{name: value})


@pytest.mark.parametrize('name', ['bag', 'map'])
def test_a_path_that_leads_nowhere_is_named_before_anything_starts(bag_command, name):
    with pytest.raises(NodlidarError, match=f"'{name}' must be .*, but is 'nowhere'"):
        launched(**{name: 'nowhere'})


def test_a_saved_map_is_taken(bag_command, tmp_path):
    (tmp_path / KEYFRAMES).touch()
    assert launched(map=str(tmp_path))[1]


def test_without_ros2_bag_nothing_starts():
    with pytest.raises(NodlidarError, match='rosbag2'):
        launched(bag='drive')
