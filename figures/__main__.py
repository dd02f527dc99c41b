"""Draws every figure into docs/figures: `python -m figures`, or some by name."""

import argparse
from pathlib import Path

from rich.console import Console

from bench.shared.names import parsed
from figures import (
    compensation,
    corner,
    coverage,
    estimators,
    mount,
    pareto,
    pattern,
    repeats,
    repeats_by_height,
    sensing,
)

FIGURES = {
    'pattern': pattern.draw,
    'coverage': coverage.draw,
    'corner': corner.draw,
    'repeats_by_height': repeats_by_height.draw,
    'repeats': repeats.draw,
    'compensation': compensation.draw,
    'pareto': pareto.draw,
    'estimators': estimators.draw,
    'sensing': sensing.draw,
    'mount': mount.draw,
}
FOLDER = Path(__file__).parent.parent / 'docs' / 'figures'


def main() -> None:
    """Draw the requested figures, by default all, and print their tables."""
    parser = argparse.ArgumentParser(prog='python -m figures', description=__doc__)
    names = parsed(parser, FIGURES).names
    FOLDER.mkdir(parents=True, exist_ok=True)
    console = Console()
    for name in names:
        console.print(FIGURES[name](FOLDER, console))


if __name__ == '__main__':
    main()
