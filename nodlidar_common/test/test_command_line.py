"""The edge of the commands: exit statuses, and one line for whatever a user or a disk causes."""

import errno
import os
import subprocess
import sys

from nodlidar_common.command_line import LineParser, run
from nodlidar_common.errors import NodlidarError, ParameterError
import pytest


def raising(error):
    def work():
        raise error

    return work


@pytest.mark.parametrize(('returned', 'status'), [(None, 0), (0, 0), (3, 3)])
def test_what_is_done_says_nothing(capsys, returned, status):
    assert run('nod', lambda: returned) == status
    assert capsys.readouterr() == ('', '')


@pytest.mark.parametrize(
    ('error', 'status', 'line'),
    [
        (ParameterError('--top', 'at least 1', 0), 2, "'--top' must be at least 1, but is 0"),
        (NodlidarError('no\n scan'), 1, 'no scan'),
        (OSError(errno.ENOSPC, 'No space left on device', 'a.ply'), 1,
         "No space left on device: 'a.ply'"),
        (OSError('gone'), 1, 'gone'),
        (MemoryError(), 1, 'there is not enough memory'),
        (ModuleNotFoundError('', name='rosbags.rosbag2'), 1,
         'needs the Python package rosbags: pip install rosbags'),
        (ModuleNotFoundError('', name='rich'), 1,
         'needs the Python package rich: pip install rich, or apt install python3-rich'),
        (ModuleNotFoundError('', name='rclpy'), 1,
         'needs the package rclpy: source the setup file of a ROS 2 that has it'),
        (KeyError('x'), 1,
         "internal error, KeyError: 'x' (set NODLIDAR_TRACEBACK=1 for a traceback)"),
    ],
)  # fmt: skip
def test_an_error_is_a_status_and_a_line(capsys, error, status, line):
    assert run('nod', raising(error)) == status
    assert capsys.readouterr() == ('', f'nod: error: {line}\n')


def test_a_line_is_not_longer_than_anyone_reads(capsys):
    assert run('nod', raising(ParameterError('scene', 'short', 'x' * 10_000))) == 2
    assert len(capsys.readouterr().err) < 1100


def test_an_interruption_has_its_status(capsys):
    assert run('nod', raising(KeyboardInterrupt())) == 130
    assert capsys.readouterr() == ('', 'nod: interrupted\n')


def test_the_traceback_is_there_for_who_asks(capsys, monkeypatch):
    monkeypatch.setenv('NODLIDAR_TRACEBACK', '1')
    assert run('nod', raising(KeyError('x'))) == 1
    assert 'in work' in capsys.readouterr().err


def test_a_wrong_option_is_a_line(capsys):
    assert run('nod', lambda: LineParser('nod', None).parse_args(['--fast\n'])) == 2
    assert capsys.readouterr() == ('', 'nod: error: unrecognized arguments: --fast\n')


def test_help_is_done(capsys):
    assert run('nod', lambda: LineParser('nod', None).parse_args(['--help'])) == 0
    assert 'usage: nod' in capsys.readouterr().out


PRINTING = """
import sys
from nodlidar_common.command_line import run
sys.exit(run('nod', lambda: print('\\u00b0' * 100_000)))
"""


def printing(**options):
    """Return the finished process of a command that prints much."""
    command = [sys.executable, '-c', PRINTING]
    environment = {**os.environ, 'PYTHONIOENCODING': 'ascii'}
    return subprocess.run(command, stderr=subprocess.PIPE, text=True, env=environment, **options)


def test_output_that_finds_no_room_is_a_line():
    with open('/dev/full', 'w') as full:
        process = printing(stdout=full)
    assert process.returncode == 1
    assert process.stderr == 'nod: error: No space left on device\n'


def test_whoever_has_seen_enough_ends_a_command_in_silence():
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, 'w') as pipe:
        process = printing(stdout=pipe)
    assert (process.returncode, process.stderr) == (1, '')


def test_characters_that_an_output_lacks_are_written_out():
    process = printing(stdout=subprocess.PIPE)
    assert (process.returncode, process.stderr) == (0, '')
    assert process.stdout == '\\xb0' * 100_000 + '\n'


def test_help_states_each_default_once(capsys):
    parser = LineParser('nod', None)
    parser.add_argument('--speed', default=2.0, help='of the nod')
    parser.add_argument('--rate', default=10, help='of scans; default: 10')
    parser.add_argument('--name', help='of the sensor')
    parser.add_argument('--fast', action='store_true', help='hurry')
    assert run('nod', lambda: parser.parse_args(['--help'])) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()[-4:]]
    assert [' '.join(line[-4:]) for line in lines] == [
        'the nod [default: 2.0]',
        'of scans; default: 10',
        'NAME of the sensor',
        '--fast hurry',
    ]
