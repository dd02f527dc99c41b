from argparse import ArgumentParser
import signal

import pytest
from ros2run.command import RunCommand


@pytest.fixture(autouse=True)
def _executables(prefix):
    library = prefix / 'lib/sample'
    scripts = {'fail': 'exit 7', 'die': 'kill -TERM $$', 'a/twice': 'true', 'b/twice': 'true'}
    for name, script in scripts.items():
        path = library / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'#!/bin/sh\n{script}\n')
        path.chmod(0o755)


def run(*argv):
    command = RunCommand()
    parser = ArgumentParser()
    command.add_arguments(parser)
    return command.main(parser.parse_args(argv))


def test_arguments_are_passed_on(capfd):
    assert run('sample', 'echo', '-a', 'b c', '--ros-args', '-p', 'x:=1') == 0
    assert capfd.readouterr().out == '-a b c --ros-args -p x:=1\n'


def test_exit_status(capfd):
    assert run('sample', 'fail') == 7
    assert capfd.readouterr().out == '[ros2run]: Process exited with failure 7\n'
    assert run('sample', 'die') == -signal.SIGTERM
    assert capfd.readouterr().out == '[ros2run]: Terminated\n'


@pytest.mark.parametrize('executable', ['none', 'data'])
def test_missing_executable(executable):
    assert run('sample', executable) == 'No executable found'


def test_missing_package():
    with pytest.raises(RuntimeError, match=r"^Package 'no_such' not found"):
        run('no_such', 'x')


def test_several_executables():
    assert run('sample', 'twice').startswith('Multiple executables found:\n- ')
