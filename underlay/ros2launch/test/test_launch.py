from argparse import ArgumentParser
import os
import signal
import subprocess

import pytest
from ros2launch.command import LaunchCommand

FILE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

def generate_launch_description():
    who = LaunchConfiguration('who')
    return LaunchDescription([
        DeclareLaunchArgument('need', description='what is needed'),
        DeclareLaunchArgument('who', default_value='you', choices=['you', 'me']),
        DeclareLaunchArgument('at', default_value=['/', who]),
        DeclareLaunchArgument('empty', default_value=''),
        ExecuteProcess(cmd=['echo', 'given', LaunchConfiguration('need'), who], output='screen'),
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
        (default: '/' + LaunchConfig('who'))

    'empty':
        no description given
        (default: '')
"""
NODES = """
import os, signal
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_ros.actions import Node

def interrupt(event, context):
    os.kill(os.getpid(), signal.SIGNAL)

def generate_launch_description():
    return LaunchDescription([
        Node(package='sample', executable='echo', parameters=[{'a': 1}], output='screen'),
        ExecuteProcess(cmd=['sleep', '60']),
        ExecuteProcess(cmd=['true'], on_exit=interrupt),
    ])
"""


@pytest.fixture
def file(prefix, monkeypatch):
    """Install a launch file in the package 'sample'."""
    monkeypatch.setenv('ROS_LOG_DIR', str(prefix / 'log'))
    path = prefix / 'share/sample/launch/sample.launch.py'
    path.parent.mkdir()
    path.write_text(FILE)
    return path


def launch(*argv):
    command = LaunchCommand()
    parser = ArgumentParser()
    command.add_arguments(parser)
    return command.main(parser.parse_args([str(word) for word in argv]))


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
    assert '] given b:=c you\n' in capsys.readouterr().out


def test_missing_and_wrong_arguments(file, capsys):
    assert launch(file, 'who:=me') == 1
    assert (
        "missing required argument 'need' (description: 'what is needed'), given: [who]"
        in capsys.readouterr().out
    )
    assert launch(file, 'need:=a', 'who:=other') == 1
    assert 'Argument "who" provided value "other" is not valid' in capsys.readouterr().out


@pytest.mark.parametrize('word', ['need', 'need:=', ':=a', 'need=a'])
def test_malformed_arguments(file, word):
    with pytest.raises(RuntimeError, match=f"malformed launch argument '{word}', expected format"):
        launch(file, word)


def test_missing_files_and_packages(file):
    for package in ('no_such', './x.launch.py'):
        with pytest.raises(RuntimeError, match=f"^Package '{package}' not found"):
            launch(package, 'x.launch.py')
    with pytest.raises(
        RuntimeError, match=r"'x\.launch\.py' was not found in the share directory"
    ):
        launch('sample', 'x.launch.py')
    (file.parent / 'other').mkdir()
    (file.parent / 'other/sample.launch.py').touch()
    with pytest.raises(RuntimeError, match='was found more than once'):
        launch('sample', 'sample.launch.py')


def test_broken_launch_file(file, capsys):
    file.write_text('def generate_launch_description():\n    return undefined\n')
    assert launch(file, '-d') == 1
    out = capsys.readouterr().out
    assert " - NameError: name 'undefined' is not defined" in out
    assert 'Traceback' in out


def test_launch_files_in_markup_are_refused(file, capsys):
    path = file.with_suffix('.xml')
    path.write_text('<launch/>')
    assert launch(path) == 1
    assert 'launch files in xml are not covered' in capsys.readouterr().out


@pytest.mark.parametrize(('number', 'status'), [(signal.SIGINT, 0), (signal.SIGTERM, 1)])
def test_no_parameter_file_and_no_process_is_left_behind(file, prefix, number, status):
    file.write_text(NODES.replace('SIGNAL', number.name))
    (prefix / 'tmp').mkdir()
    env = {**os.environ, 'TMPDIR': str(prefix / 'tmp')}
    ended = subprocess.run(
        ['ros2', 'launch', str(file)],
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert ended.returncode == status
    assert f'--params-file {prefix}/tmp/launch_params_' in ended.stdout
    assert "exit code -2, cmd 'sleep 60'" in ended.stdout
    assert list((prefix / 'tmp').iterdir()) == []
