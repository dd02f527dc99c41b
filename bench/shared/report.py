"""Results of a measurement as a table, as Markdown and as recorded JSON.

A measurement is a module with a TITLE and `results() -> list[Row]`.
"""

from importlib.metadata import PackageNotFoundError, version
import json
import math
import os
from pathlib import Path
import platform
import subprocess
import textwrap
import time
from typing import Any

from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

RESULTS = Path(__file__).parents[1] / 'results'
DIGITS = 6  # significant ones that are recorded
VERSIONS = ('numpy', 'rclpy')
_WIDEST = Console(width=10_000)
WRITTEN = (':!bench/results', ':!docs', ':!*.md')  # by measurements

# What is measured -> a number or words. The unit is in the key, in brackets.
Row = dict[str, Any]


def table(title: str, rows: list[Row], width: int = 80) -> Table:
    """Return rows as a table for a terminal of a width [characters], which cuts no word.

    Where a line per row is too wide, headings are broken; then there is a line per heading and a
    column per row; then the rows follow each other with a line per value.
    """
    layouts = (_upright(rows), _upright(rows, broken=True), _turned(rows))
    result = next((each for each in layouts if _fits(each, width)), _one_by_one(rows))
    result.title = escape(title)  # units are in brackets
    return result


def _upright(rows: list[Row], broken: bool = False) -> Table:
    """Return a line per row; columns of words are flush left."""
    result = Table()
    for heading in headings(rows):
        values = [row.get(heading, '') for row in rows]
        words = all(isinstance(value, str) for value in values)
        widest = max([*map(len, heading.split()), *(len(in_words(value)) for value in values)])
        lines = textwrap.wrap(heading, widest, break_on_hyphens=False) if broken else [heading]
        justify: JustifyMethod = 'left' if words else 'right'
        result.add_column(escape('\n'.join(lines)), justify=justify, no_wrap=True)
    for row in rows:
        result.add_row(*_cells(row, headings(rows)))
    return result


def _turned(rows: list[Row]) -> Table:
    """Return a line per heading, and a column per row."""
    result = Table(show_header=False)
    result.add_column(no_wrap=True)
    for _ in rows:
        result.add_column(justify='right', no_wrap=True)
    lines = [_cells(row, headings(rows)) for row in rows]
    for heading, *values in zip(headings(rows), *lines, strict=True):
        result.add_row(escape(heading), *values)
    return result


def _one_by_one(rows: list[Row]) -> Table:
    """Return a line per value, and a section per row; long words are folded."""
    result = Table(show_header=False)
    result.add_column(overflow='fold')
    result.add_column(overflow='fold')
    for row in rows:
        for heading, value in zip(row, _cells(row, list(row)), strict=True):
            result.add_row(escape(heading), value)
        result.add_section()
    return result


def _cells(row: Row, keys: list[str]) -> list[str]:
    return [escape(in_words(row.get(key))) for key in keys]


def _fits(result: Table, width: int) -> bool:
    return Measurement.get(_WIDEST, _WIDEST.options, result).maximum <= width


def markdown(rows: list[Row]) -> str:
    """Return rows as a Markdown table."""
    cells = [[in_words(row.get(heading)) for heading in headings(rows)] for row in rows]
    lines = [headings(rows), ['---'] * len(headings(rows)), *cells]
    return '\n'.join(f'| {" | ".join(line)} |' for line in lines)


def headings(rows: list[Row]) -> list[str]:
    """Return the keys of all rows, in the order in which they first occur."""
    return list(dict.fromkeys(key for row in rows for key in row))


def in_words(value: object) -> str:
    """Return a number with three digits, or all digits before the point; None as empty text."""
    if value is None:
        return ''
    if not isinstance(value, float) or not math.isfinite(value):
        return str(value)
    return f'{value:.0f}' if abs(value) >= 100.0 else f'{value:.3g}'


def recording(rows: list[Row], title: str, commit: str) -> dict[str, Any]:
    """Return the record of a measurement: its rows, commit, date, machine and versions."""
    return {
        'title': title,
        'commit': commit,
        'date': time.strftime('%Y-%m-%d', time.gmtime()),
        'machine': {'cpu': _cpu(), 'cores': os.cpu_count()},
        'versions': {'python': platform.python_version(), **_versions()},
        'rows': [{key: _rounded(value) for key, value in row.items()} for row in rows],
    }


def record(name: str, recorded: dict[str, Any]) -> None:
    """Write the record of a measurement into RESULTS."""
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps(recorded, indent=1, ensure_ascii=False, allow_nan=False)
    (RESULTS / f'{name}.json').write_text(text + '\n')


def recorded(name: str) -> dict[str, Any]:
    """Return the last record of a measurement."""
    result: dict[str, Any] = json.loads((RESULTS / f'{name}.json').read_text())
    return result


def commit() -> str:
    """Return the commit that is checked out, with '-dirty' if the code was changed since."""
    changes = ['status', '--porcelain', '--untracked-files=no', '--', '.', *WRITTEN]
    changed = '-dirty' if _git(*changes) else ''
    return (_git('rev-parse', '--short=12', 'HEAD') or 'unknown') + changed


def _git(*arguments: str) -> str:
    command = ['git', *arguments]
    run = subprocess.run(command, cwd=RESULTS.parent.parent, capture_output=True, text=True)
    return run.stdout.strip()


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f'{value:.{DIGITS}g}') if math.isfinite(value) else str(value)
    return value.item() if hasattr(value, 'item') else value


def _cpu() -> str:
    information = Path('/proc/cpuinfo')
    lines = information.read_text().splitlines() if information.exists() else []
    names = [line.split(':', 1)[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.machine()


def _versions() -> dict[str, str]:
    found = {}
    for package in VERSIONS:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = 'none'
    return found
