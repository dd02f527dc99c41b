"""What a faster nod wins and loses, as last recorded: completion and holes over distance."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from bench.pareto import figure
from bench.report import recorded, table


def draw(folder: Path, _console: Console) -> Table:
    """Draw the fronts of all scenes; return what they are made of."""
    pareto = recorded('pareto')
    figure(pareto['rows']).savefig(folder / 'pareto.png', dpi=110)
    return table(pareto['title'], pareto['rows'])
