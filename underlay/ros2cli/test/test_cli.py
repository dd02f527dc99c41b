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
