"""A Ctrl-C while the nodes of a launch start."""

import asyncio
import os
import signal
import subprocess
import sys

from launch import LaunchContext
from nodlidar_bringup.ros.tied_node import tied_node
import pytest


@pytest.fixture(autouse=True)
def python_s_handler():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Context(LaunchContext):
    asyncio_loop = None  # a test sets it, as a launch does while it runs


@pytest.fixture
def running():
    """Return the context of a launch that runs."""
    context = Context()
    context.asyncio_loop = asyncio.new_event_loop()
    yield context
    context.asyncio_loop.close()


def make_node(context):
    tied_node(context, 'nodlidar_sim', 'emulate', namespace='')


def interrupt():
    """Return whether a SIGINT raises KeyboardInterrupt."""
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        return True
    return False


def test_ctrl_c_raises_nothing_while_a_launch_runs(running):
    make_node(running)
    assert not interrupt()
    assert not interrupt()


def test_ctrl_c_ends_a_program_that_runs_no_launch():
    make_node(Context())
    assert interrupt()


def test_ctrl_c_raises_nothing_while_a_second_launch_runs(running):
    make_node(Context())  # the first has ended
    make_node(running)
    assert not interrupt()


def test_a_handler_that_a_program_has_set_is_kept(running):
    received = []
    signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    make_node(running)
    assert not interrupt()
    assert received == [signal.SIGINT]


# SIGINT arrives before the launch knows the process that it has started, and again after its end.
INTERRUPTED = """
import signal, subprocess
from launch import LaunchDescription, LaunchService
from launch.actions import ExecuteProcess, OpaqueFunction
from nodlidar_bringup.ros.tied_node import tied_node

class Popen(subprocess.Popen):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        signal.raise_signal(signal.SIGINT)

def nodes(context):
    tied_node(context, 'nodlidar_sim', 'emulate', namespace='')
    subprocess.Popen = Popen
    return [ExecuteProcess(cmd=['sleep', '100'], output='screen')]

signal.signal(signal.SIGINT, signal.default_int_handler)
service = LaunchService(noninteractive=True)
service.include_launch_description(LaunchDescription([OpaqueFunction(function=nodes)]))
assert service.run() == 0
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print('interrupted')
"""


def test_a_launch_ends_that_is_interrupted_while_it_starts_a_process():
    command = [sys.executable, '-c', INTERRUPTED]
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=60)
    assert ended.returncode == 0
    assert ended.stdout.endswith(b'interrupted\n')


# SIGINT arrives at the launch alone: before its node exists, or once that runs and ignores it, as
# one that is starting does. launch itself would end it by SIGTERM an hour later.
ALONE = """
import pathlib, signal, subprocess, sys, time
from launch import LaunchDescription, LaunchService
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from nodlidar_bringup.ros.tied_node import tied_node

moment, ready, terminal = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3] == 'terminal'

class Popen(subprocess.Popen):
    def __init__(self, *arguments, **options):
        if moment == 'before it exists':
            signal.raise_signal(signal.SIGINT)
        super().__init__(*arguments, **options)
        if moment == 'while it starts':
            while not ready.exists():
                time.sleep(0.01)
            signal.raise_signal(signal.SIGINT)

def nodes(context):
    subprocess.Popen = Popen
    end = lambda event, context: print('exit code', event.returncode)
    return [tied_node(context, 'sample', 'starting', namespace='', on_exit=end)]

timeout = DeclareLaunchArgument('sigterm_timeout', default_value='3600', description='')
service = LaunchService(noninteractive=not terminal)
service.include_launch_description(LaunchDescription([timeout, OpaqueFunction(function=nodes)]))
sys.exit(service.run())
"""


@pytest.mark.parametrize(
    ('moment', 'terminal'),
    [
        ('before it exists', 'terminal'),
        ('while it starts', 'terminal'),
        ('while it starts', 'no terminal'),
    ],
)
def test_an_interrupt_ends_a_node_that_did_not_hear_it(tmp_path, moment, terminal):
    index = tmp_path / 'share/ament_index/resource_index/packages'
    library, ready = tmp_path / 'lib/sample', tmp_path / 'ready'
    for folder in (index, library):
        folder.mkdir(parents=True)
    (index / 'sample').touch()
    (library / 'starting').write_text(f'#!/bin/sh\ntouch {ready}\nexec sleep 3600\n')
    (library / 'starting').chmod(0o755)
    paths = f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}'
    ended = subprocess.run(
        [sys.executable, '-c', ALONE, moment, ready, terminal],
        env={**os.environ, 'AMENT_PREFIX_PATH': paths},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        timeout=60,
    )
    assert ended.returncode == 0
    codes = [line for line in ended.stdout.splitlines() if line.startswith('exit code')]
    assert codes == [f'exit code {-signal.SIGTERM}']
