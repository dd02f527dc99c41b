"""Draws every figure into docs/figures: `python -m figures`, or some by name."""

from pathlib import Path

from rich.console import Console

from bench.names import names_from_command_line
from figures import compensation, corner, coverage, pattern, repeats, repeats_by_height

FIGURES = {
    'pattern': pattern.draw,
    'coverage': coverage.draw,
    'corner': corner.draw,
    'repeats_by_height': repeats_by_height.draw,
    'repeats': repeats.draw,
    'compensation': compensation.draw,
}
FOLDER = Path(__file__).parent.parent / 'docs' / 'figures'


def main() -> None:
    """Draw the figures that were asked for, by default all, and print what they show."""
    names = names_from_command_line('python -m figures', str(__doc__), FIGURES)
    FOLDER.mkdir(parents=True, exist_ok=True)
    console = Console()
    for name in names:
        console.print(FIGURES[name](FOLDER, console))


if __name__ == '__main__':
    main()
