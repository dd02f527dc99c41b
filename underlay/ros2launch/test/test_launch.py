from argparse import ArgumentParser
import os
import signal
import subprocess

import pytest
from ros2launch.command import LaunchCommand

FILE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction

def echo(context):
    values = context.launch_configurations
    return [ExecuteProcess(cmd=['echo', 'given', values['at'], values['who']], output='screen')]

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument(
            'who', default_value='you', description='for whom', choices=['you', 'me']
        ),
        DeclareLaunchArgument('at', default_value='', description='where'),
        OpaqueFunction(function=echo),
    ])
"""
ARGUMENTS = """\
Arguments (pass arguments as '<name>:=<value>'):

    'who':
        for whom. Valid choices are: ['you', 'me']
        (default: 'you')

    'at':
        where
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
    sample = {'package': 'sample', 'executable': 'echo', 'namespace': ''}
    return LaunchDescription([
        Node(**sample, parameters=[{'a': 1}], output='screen'),
        ExecuteProcess(cmd=['sleep', '60'], output='screen'),
        ExecuteProcess(cmd=['true'], output='screen', on_exit=interrupt),
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
    return command.main(parser.parse_args(argv))


def test_arguments_are_described(file, capsys):
    for option in ('-s', '--show-args', '--show-arguments'):
        assert not launch('sample', 'sample.launch.py', option)
        assert capsys.readouterr().out == ARGUMENTS


def test_arguments_are_passed(file, capsys):
    assert launch('sample', 'sample.launch.py', 'at:=a', 'at:=b:=c', 'extra:=d') == 0
    assert '] given b:=c you\n' in capsys.readouterr().out


def test_wrong_arguments(file, capsys):
    assert launch('sample', 'sample.launch.py', 'who:=other') == 1
    assert 'Argument "who" provided value "other" is not valid' in capsys.readouterr().out


@pytest.mark.parametrize('word', ['need', 'need:=', ':=a', 'need=a'])
def test_malformed_arguments(file, word):
    with pytest.raises(RuntimeError, match=f"malformed launch argument '{word}', expected format"):
        launch('sample', 'sample.launch.py', word)


def test_missing_files_and_packages(file):
    for package in ('no_such', './x.launch.py'):
        with pytest.raises(RuntimeError, match=f"^Package '{package}' not found"):
            launch(package, 'x.launch.py')
    with pytest.raises(
        RuntimeError, match=r"'x\.launch\.py' was not found in the share directory"
    ):
        launch('sample', 'x.launch.py')


def test_broken_launch_file(file, capsys):
    file.write_text('def generate_launch_description():\n    return undefined\n')
    assert launch('sample', 'sample.launch.py', '-d') == 1
    out = capsys.readouterr().out
    assert "Caught exception in launch (see debug for traceback): name 'undefined' is not" in out
    assert 'Traceback' in out


@pytest.mark.parametrize(('number', 'status'), [(signal.SIGINT, 0), (signal.SIGTERM, 1)])
def test_no_parameter_file_and_no_process_is_left_behind(file, prefix, number, status):
    file.write_text(NODES.replace('SIGNAL', number.name))
    (prefix / 'tmp').mkdir()
    env = {**os.environ, 'TMPDIR': str(prefix / 'tmp')}
    ended = subprocess.run(
        ['ros2', 'launch', 'sample', 'sample.launch.py'],
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
