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
import time
from typing import Any

from rich.table import Table

RESULTS = Path(__file__).parent / 'results'
DIGITS = 6  # significant ones that are recorded
VERSIONS = ('numpy', 'rclpy')
WRITTEN = (':!bench/results', ':!docs', ':!*.md')  # by measurements

# What is measured -> a number or words. The unit is in the key, in brackets.
Row = dict[str, Any]


def table(title: str, rows: list[Row]) -> Table:
    """Return rows as a table for a terminal; columns of words are flush left."""
    result = Table(title=title)
    for heading in headings(rows):
        words = all(isinstance(row.get(heading, ''), str) for row in rows)
        result.add_column(heading.replace('[', r'\['), justify='left' if words else 'right')
    for row in rows:
        result.add_row(*(in_words(row.get(heading)) for heading in headings(rows)))
    return result


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
