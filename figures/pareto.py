"""What a faster nod gains and loses, as last recorded: completion and holes over distance."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from bench.nod.pareto import FRONTS, N_S, RMS, SCENE, SCENES
from bench.shared.report import recorded, Row, table

COLOURS = dict(zip(SCENES, ('tab:blue', 'tab:orange', 'tab:green'), strict=True))


def draw(folder: Path, _console: Console) -> Table:
    """Draw the fronts of all scenes into pareto.png; return their rows."""
    pareto = recorded('pareto')
    figure(pareto['rows']).savefig(folder / 'pareto.png', dpi=110)
    return table(pareto['title'], pareto['rows'])


def figure(rows: Sequence[Row]) -> Figure:
    """Draw completion and hole against distance, by scene, with N_s and the fronts."""
    result = Figure(figsize=(12, 5), layout='constrained')
    for axes, (front, key) in zip(result.subplots(1, 2), FRONTS.items(), strict=True):
        for scene, colour in COLOURS.items():
            _draw(axes, [row for row in rows if row[SCENE] == scene], key, front, colour)
        axes.set(xlabel=RMS, ylabel=key, xscale='log', yscale='log')
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter('{x:g}')
            axis.set_minor_formatter('{x:g}')
        axes.grid(alpha=0.3, which='both')
        axes.legend()
    return result


def _draw(axes: Axes, rows: list[Row], key: str, front: str, colour: str) -> None:
    """Draw the nods of a scene that have both figures, and join those on the front."""
    shown = [row for row in rows if row.get(key) is not None]
    x, y = ([row[k] for row in shown] for k in (RMS, key))
    axes.scatter(x, y, color=colour, s=16, label=rows[0][SCENE])
    for row in shown:
        axes.annotate(f' {row[N_S]}', (row[RMS], row[key]), color=colour, fontsize=7)
    best = sorted((row[RMS], row[key]) for row in shown if row.get(front))
    axes.plot(*zip(*best, strict=True), color=colour, linewidth=1)
