"""What a command prints: its result to stdout, a progress bar to stderr."""

from collections.abc import Iterable
import sys

from rich.console import Console
from rich.progress import Progress, ProgressColumn
from rich.table import Table

WIDTH = 100  # of tables on a stdout that is no terminal


def result_console() -> Console:
    """Return the console for a command's result, which prints texts as they are."""
    width = None if sys.stdout.isatty() else WIDTH
    return Console(width=width, markup=False, highlight=False, emoji=False)


def summary_table(rows: Iterable[tuple[str, object]], title: str | None = None) -> Table:
    """Return names and values as a table, in which long texts are folded."""
    table = Table(title=title, show_header=False)
    table.add_column(overflow='fold')
    table.add_column(justify='right', overflow='fold')
    for name, value in rows:
        table.add_row(name, str(value))
    return table


def progress_bar(
    *columns: ProgressColumn, console: Console | None = None, stays: bool = False
) -> Progress:
    """Return a progress bar, hidden where no line can be redrawn: in a file, or with TERM=dumb.

    Parameters
    ----------
    columns
        By default those of rich.
    console
        By default that of stderr.
    stays
        Whether the bar is still shown at the end.
    """
    console = console or Console(stderr=True)
    redraws = console.is_terminal and not console.is_dumb_terminal
    return Progress(*columns, console=console, transient=not stays, disable=not redraws)
