"""What is recorded, and pages that show it."""

import io
import json
import math
import platform

import numpy as np
import pytest
from rich.console import Console

from bench.__main__ import MEASUREMENTS
from bench.shared import page, report

ROWS = [
    {'what': 'a', 'time [ms]': 1.23456789, 'count': np.int64(4001)},
    {'what': 'b', 'time [ms]': math.inf, 'RMS [mm]': np.float64(1234.5)},
]
RECORDED = sorted(path.stem for path in report.RESULTS.glob('*.json'))


def test_rows_become_markdown_with_a_heading_for_every_key():
    assert report.markdown(ROWS).splitlines() == [
        '| what | time [ms] | count | RMS [mm] |',
        '| --- | --- | --- | --- |',
        '| a | 1.23 | 4001 |  |',
        '| b | inf |  | 1234 |',
    ]


def test_a_recording_is_read_back_with_six_digits_and_what_it_was_made_with(tmp_path, monkeypatch):
    monkeypatch.setattr(report, 'RESULTS', tmp_path)
    report.record('some', report.recording(ROWS, 'Some', 'abc'))
    read = report.recorded('some')
    assert read['rows'] == [
        {'what': 'a', 'time [ms]': 1.23457, 'count': 4001},
        {'what': 'b', 'time [ms]': 'inf', 'RMS [mm]': 1234.5},
    ]
    assert (read['title'], read['commit']) == ('Some', 'abc')
    assert read['versions']['numpy'] == np.__version__
    assert platform.node() not in json.dumps(read)


def test_a_page_takes_up_what_is_recorded_between_its_marks(tmp_path, monkeypatch):
    monkeypatch.setattr(report, 'RESULTS', tmp_path)
    report.record('some', report.recording(ROWS[:1], 'Some', 'abc'))
    text = 'Before.\n\n<!-- bench: some -->\nold\n<!-- end -->\n\nAfter.\n'
    filled = page.filled(text)
    chosen = page.filled(text.replace('some -->', 'some: count; what -->'))
    assert '<!-- bench: some: count; what -->\n| count | what |\n' in chosen
    assert '| 4001 | a |' in chosen
    assert filled.startswith('Before.\n\n<!-- bench: some -->\n| what |')
    source = f'*`python -m bench some`, commit abc, {report.recorded("some")["date"]}*'
    assert filled.endswith(f'| a | 1.23 | 4001 |\n\n{source}\n<!-- end -->\n\nAfter.\n')
    assert page.filled(filled) == filled


def test_a_page_takes_the_rows_that_it_asks_for(tmp_path, monkeypatch):
    monkeypatch.setattr(report, 'RESULTS', tmp_path)
    rows = [{'kind': kind, 'error [ms]': error} for kind in 'abc' for error in (1.0, 3.0)]
    report.record('some', report.recording(rows, 'Some', 'abc'))
    text = '<!-- bench: some where MARK -->\n<!-- end -->\n'
    by_number = page.filled(text.replace('MARK', 'error [ms] = 3.0: kind')).splitlines()
    assert by_number[3:-3] == ['| a |', '| b |', '| c |']
    by_words = page.filled(text.replace('MARK', 'kind = a | c')).splitlines()
    assert by_words[3:-3] == ['| a | 1 |', '| a | 3 |', '| c | 1 |', '| c | 3 |']


@pytest.mark.parametrize('path', page.PAGES, ids=lambda path: path.name)
def test_pages_show_what_is_recorded(path):
    """`make bench` fills them; a number that was edited by hand is found here."""
    assert '<!-- bench: ' in path.read_text()
    assert page.filled(path.read_text()) == path.read_text()


@pytest.mark.parametrize('name', RECORDED)
def test_what_is_recorded_is_of_a_measurement_and_tells_where_it_comes_from(name):
    found = report.recorded(name)
    assert name in MEASUREMENTS
    assert found['rows']
    assert all(found[key] for key in ('title', 'commit', 'date', 'versions'))
    assert found['machine']['cores'] >= 1


@pytest.mark.parametrize('name', RECORDED)
def test_a_table_of_80_columns_cuts_no_heading_and_no_value(name):
    found = report.recorded(name)
    console = Console(width=80, file=io.StringIO())
    with console.capture() as capture:
        console.print(report.table(found['title'], found['rows'], console.width))
    text = capture.get()
    assert '…' not in text
    assert max(map(len, text.splitlines())) <= 80
    # Breaks and frames aside, all is there: as often as it is in the rows.
    printed = ''.join(text.split()).translate(dict.fromkeys(map(ord, '│─┃━')))
    assert printed.startswith(''.join(found['title'].split()))
    for row in found['rows']:
        for cell in (*row, *map(report.in_words, row.values())):
            for word in cell.split():
                assert word in printed, (cell, word)


def test_a_table_is_turned_and_taken_apart_only_where_it_is_too_wide():
    rows = [{f'quantity {k} [m]': float(k) for k in range(12)}] * 2
    lines = {width: _lines(report.table('', rows, width)) for width in (300, 150, 80)}
    assert lines == {300: 4 + 2, 150: 5 + 2, 80: 12 + 2}  # headings of one line, of two; turned
    many = [{**rows[0], 'name': 'n' * 20}] * 5
    assert _lines(report.table('', many, 80)) == 5 * 13 + 4 + 2


def _lines(table):
    console = Console(width=300)
    with console.capture() as capture:
        console.print(table)
    return len(capture.get().splitlines())
