"""Prints every measurement: `python -m bench`, or some: `python -m bench accuracy`."""

import argparse
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
import sys
from types import ModuleType

from rich import get_console
from rich.console import Console

import bench
from bench.cost import hot_paths
from bench.shared.names import parsed
from bench.shared.page import fill_pages
from bench.shared.report import commit, record, recorded, recording, table


def _measurements() -> dict[str, ModuleType]:
    """Return the modules with a TITLE, by name; their folders say what they measure."""
    names = [found.name for found in walk_packages(bench.__path__, 'bench.')]
    modules = [import_module(name) for name in names if not name.endswith('.__main__')]
    return {each.__name__.split('.')[-1]: each for each in modules if hasattr(each, 'TITLE')}


MEASUREMENTS = _measurements()


def main() -> None:
    """Print the requested measurements, by default all; record them on request."""
    parser = argparse.ArgumentParser(prog='python -m bench', description=__doc__)
    parser.add_argument(
        '--record',
        action='store_true',
        help='write results into bench/results and the pages that show them',
    )
    parser.add_argument(
        '--compare',
        action='store_true',
        help='report what became slower than recorded; the exit status is then 1',
    )
    parser.add_argument(
        '--against',
        type=Path,
        metavar='FOLDER',
        help='another version, built there: processor_time, which needs it, measures it, too',
    )
    arguments = parsed(parser, MEASUREMENTS)
    console = get_console()
    if arguments.compare:
        sys.exit(_compare(console))
    measured_at = commit()
    for name in arguments.names:
        if name == 'processor_time' and arguments.against is None:
            console.print('processor_time: left out, since it needs --against')
            continue
        measurement = MEASUREMENTS[name]
        with console.status(name):
            rows = measurement.results(*_of_another_version(name, arguments.against))
        console.print(table(measurement.TITLE, rows, console.width))
        if arguments.record:
            record(name, recording(rows, measurement.TITLE, measured_at))
    if arguments.record:
        fill_pages()


def _of_another_version(name: str, against: Path | None) -> list[Path]:
    return [against] if name == 'processor_time' and against else []


def _compare(console: Console) -> int:
    """Print what became slower than recorded; return 1 if anything did."""
    before = recorded('hot_paths')
    with console.status('hot_paths'):
        rows = hot_paths.comparison(hot_paths.results(), before['rows'])
    title = f'Against {before["commit"]} of {before["date"]}'
    console.print(table(title, rows, console.width))
    return int(any(row[hot_paths.VERDICT] for row in rows))


if __name__ == '__main__':
    main()
