"""What a command prints, to a terminal and to a file."""

import io

from nodlidar_common.terminal import progress_bar, result_console, summary_table
import pytest
from rich.console import Console
from rich.table import Table


def test_a_table_in_a_file_is_as_wide_as_it_needs_and_at_most_100_columns(capsys):
    for width in (90, 200):
        table = Table(show_header=False, box=None, padding=0)
        table.add_row('x' * width)
        result_console().print(table)
    longest = [max(map(len, line.split())) for line in capsys.readouterr().out.splitlines()]
    assert longest == [90, 100]


def test_texts_of_a_result_are_printed_as_they_are(capsys):
    result_console().print('[red]/a:smile:b[/red]')
    assert capsys.readouterr().out == '[red]/a:smile:b[/red]\n'


def test_no_name_or_value_of_a_summary_is_cut(capsys):
    result_console().print(summary_table([('n' * 150, 'v' * 150), ('scans', 201)]))
    printed = capsys.readouterr().out
    assert (printed.count('n'), printed.count('v')) == (151, 150)
    assert '201' in printed


@pytest.mark.parametrize(
    ('term', 'is_terminal', 'redrawn'),
    [('xterm', True, True), ('dumb', True, False), ('xterm', False, False)],
)
def test_progress_is_shown_where_a_line_can_be_redrawn(monkeypatch, term, is_terminal, redrawn):
    monkeypatch.setenv('TERM', term)
    shown = io.StringIO()
    with progress_bar(console=Console(file=shown, force_terminal=is_terminal)) as progress:
        progress.add_task('waiting for the first cloud', total=1.0)
    assert ('waiting' in shown.getvalue()) == redrawn
