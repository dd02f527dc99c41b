from argparse import ArgumentParser
import os
import signal

import pytest
from ros2run.command import RunCommand


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Install a package 'sample' with a few executables."""
    index = tmp_path / 'share/ament_index/resource_index/packages'
    library = tmp_path / 'lib/sample'
    for directory in (index, library / 'a', library / 'b'):
        directory.mkdir(parents=True)
    (index / 'sample').touch()
    scripts = {'echo': 'echo "$@"', 'fail': 'exit 7', 'die': 'kill -TERM $$'}
    scripts.update({'a/twice': 'true', 'b/twice': 'true'})
    for name, script in scripts.items():
        (library / name).write_text(f'#!/bin/sh\n{script}\n')
        (library / name).chmod(0o755)
    (library / 'data').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    return tmp_path


def run(*argv):
    command = RunCommand()
    parser = ArgumentParser()
    command.add_arguments(parser, 'ros2 run')
    return command.main(parser=parser, args=parser.parse_args(argv))


def test_arguments_are_passed_on(prefix, capfd):
    assert run('sample', 'echo', '-a', 'b c', '--ros-args', '-p', 'x:=1') == 0
    assert capfd.readouterr().out == '-a b c --ros-args -p x:=1\n'


def test_exit_status(prefix, capfd):
    assert run('sample', 'fail') == 7
    assert capfd.readouterr().out == '[ros2run]: Process exited with failure 7\n'
    assert run('sample', 'die') == -signal.SIGTERM
    assert capfd.readouterr().out == '[ros2run]: Terminated\n'


def test_prefix(prefix, capfd):
    assert run('--prefix', 'echo "a b"', 'sample', 'echo', 'c') == 0
    assert capfd.readouterr().out == f'a b {prefix}/lib/sample/echo c\n'


@pytest.mark.parametrize('executable', ['none', 'data'])
def test_missing_executable(prefix, executable):
    assert run('sample', executable) == 'No executable found'


def test_missing_package():
    with pytest.raises(RuntimeError, match=r"^Package 'no_such' not found$"):
        run('no_such', 'x')


def test_several_executables(prefix):
    with pytest.raises(RuntimeError, match=r'Multiple executables found:\n- .*/a/twice\n- .*/b/t'):
        run('sample', 'twice')
