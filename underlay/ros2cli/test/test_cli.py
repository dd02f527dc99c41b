import os
from pathlib import Path
import subprocess
import sys

import pytest
from ros2cli import cli


class Say:
    """Say a word."""

    def add_arguments(self, parser):
        parser.add_argument('word', help='what it says')

    def main(self, args):
        if args.word == 'interrupt':
            raise KeyboardInterrupt
        if args.word == 'fail':
            raise RuntimeError('it failed')
        print(args.word)
        return 3


@pytest.fixture(autouse=True)
def _commands(monkeypatch):
    monkeypatch.setattr(cli, 'load_commands', lambda: {'say': Say()})
    # pytest's own output stream stays as it is.
    monkeypatch.setattr(sys.stdout, 'reconfigure', lambda **options: None, raising=False)


def test_command_is_called(capsys):
    assert cli.main(['say', 'word']) == 3
    assert capsys.readouterr().out == 'word\n'


def test_errors_and_interrupts():
    assert cli.main(['say', 'fail']) == 'it failed'
    assert cli.main(['say', 'interrupt']) == 2


def test_a_reader_that_is_gone_is_no_traceback():
    """As with head: the pipe is closed before the command prints."""
    code = (
        'import sys; from ros2cli import cli; from test_cli import Say; '
        "cli.load_commands = lambda: {'say': Say()}; sys.exit(cli.main(['say', 'word']))"
    )
    reading, writing = os.pipe()
    os.close(reading)
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get('PYTHONPATH', '')])
    ended = subprocess.run(
        [sys.executable, '-c', code],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, 'PYTHONPATH': path},
        check=False,
    )
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (1, '')


def test_uncovered_command_is_refused_by_name():
    assert cli.main(['topic', 'list']).startswith(
        "'ros2 topic' is not covered by the underlay, which has: say."
    )


def test_help(capsys):
    assert cli.main([]) == 0
    assert 'say' in capsys.readouterr().out
    with pytest.raises(SystemExit) as end:
        cli.main(['say', '--help'])
    assert end.value.code == 0
    assert 'what it says' in capsys.readouterr().out


def test_wrong_arguments(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(['say'])
    assert end.value.code == 2
    assert 'required: word' in capsys.readouterr().err
