from argparse import ArgumentParser
import os

import pytest
from ros2launch.command import LaunchCommand

FILE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, LogInfo
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution

def generate_launch_description():
    who = LaunchConfiguration('who')
    return LaunchDescription([
        DeclareLaunchArgument('need', description='what is needed'),
        DeclareLaunchArgument('who', default_value='you', choices=['you', 'me']),
        DeclareLaunchArgument('at', default_value=PathJoinSubstitution(['/', who])),
        GroupAction([DeclareLaunchArgument('rare', default_value=[])], condition=IfCondition('0')),
        LogInfo(msg=['given ', LaunchConfiguration('need'), ' ', who,
                     ' ', LaunchConfiguration('extra', default='none')]),
        ExecuteProcess(cmd=['echo', 'quiet'], name='p'),
    ])
"""
ARGUMENTS = """\
Arguments (pass arguments as '<name>:=<value>'):

    'need':
        what is needed

    'who':
        One of: ['you', 'me']
        (default: 'you')

    'at':
        no description given
        (default: PathJoin(''/' + LaunchConfig('who')'))

    'rare':*
        no description given
        (default: )

* argument(s) which are only used if specific conditions occur
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Install a package 'sample' with a launch file."""
    index = tmp_path / 'share/ament_index/resource_index/packages'
    directory = tmp_path / 'share/sample/launch'
    for folder in (index, directory, directory / 'other'):
        folder.mkdir(parents=True)
    (index / 'sample').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))
    path = directory / 'sample.launch.py'
    path.write_text(FILE)
    return path


def launch(*argv):
    command = LaunchCommand()
    parser = ArgumentParser()
    command.add_arguments(parser, 'ros2 launch')
    return command.main(parser=parser, args=parser.parse_args([str(word) for word in argv]))


def test_arguments_are_described(file, capsys):
    for option in ('-s', '--show-args', '--show-arguments'):
        assert not launch('sample', 'sample.launch.py', option)
        assert capsys.readouterr().out == ARGUMENTS


def test_no_arguments(file, capsys):
    file.write_text('import launch\ngenerate_launch_description = launch.LaunchDescription\n')
    assert not launch(file, '-s')
    assert capsys.readouterr().out.endswith('\n\n  No arguments.\n')


@pytest.mark.parametrize('by_path', [True, False])
def test_arguments_are_passed(file, capsys, by_path):
    where = [file] if by_path else ['sample', 'sample.launch.py']
    assert launch(*where, 'need:=a', 'need:=b:=c', 'extra:=d') == 0
    out = capsys.readouterr().out
    assert 'given b:=c you d' in out
    assert '] quiet' not in out


def test_all_output_on_demand(file, capsys, monkeypatch):
    monkeypatch.setenv('OVERRIDE_LAUNCH_PROCESS_OUTPUT', '')  # so that it is as before afterwards
    assert launch(file, 'need:=a', '-a') == 0
    assert '] quiet' in capsys.readouterr().out


def test_missing_and_wrong_arguments(file, capsys):
    assert launch(file) == 1
    assert "missing required argument 'need'" in capsys.readouterr().out
    assert launch(file, 'need:=a', 'who:=other') == 1
    assert 'Argument "who" provided value "other" is not valid' in capsys.readouterr().out


@pytest.mark.parametrize('word', ['need', 'need:=', ':=a', 'need=a'])
def test_malformed_arguments(file, word):
    with pytest.raises(RuntimeError, match=f"malformed launch argument '{word}', expected format"):
        launch(file, word)


def test_missing_files_and_packages(file):
    with pytest.raises(RuntimeError, match=r"^Package 'no_such' not found"):
        launch('no_such', 'x.launch.py')
    with pytest.raises(
        RuntimeError, match=r"'x\.launch\.py' was not found in the share directory"
    ):
        launch('sample', 'x.launch.py')
    with pytest.raises(RuntimeError, match='neither a launch file nor the name of a package'):
        launch('./x.launch.py')
    (file.parent / 'other/sample.launch.py').touch()
    with pytest.raises(RuntimeError, match='was found more than once'):
        launch('sample', 'sample.launch.py')


def test_broken_launch_file(file, capsys):
    file.write_text('def generate_launch_description():\n    return undefined\n')
    assert launch(file) == 1
    assert "NameError: name 'undefined' is not defined" in capsys.readouterr().out


def test_launch_files_in_markup_are_refused(file, capsys):
    path = file.with_suffix('.xml')
    path.write_text('<launch/>')
    assert launch(path) == 1
    assert 'launch files in xml are not covered' in capsys.readouterr().out
