"""Pitch error over the rate of the joint states, by estimator and encoder, as last recorded."""

from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
from rich.console import Console
from rich.table import Table

from bench.errors.sensing import column, ESTIMATORS, REAL, TICKS
from bench.shared.report import recorded, table
from figures.estimators import COLOURS
from figures.saving import save

LINES = dict(zip(TICKS, ('-', '--'), strict=True))


def draw(folder: Path, _console: Console) -> Table:
    """Draw the recorded rows into sensing.png; return them."""
    found = recorded('sensing')
    figure, axes = plt.subplots(figsize=(7.5, 4.5))
    for estimator, bits in product(ESTIMATORS, TICKS):
        rows = [row for row in found['rows'] if row['encoder [bits]'] == bits]
        axes.plot(
            [row['joint states [Hz]'] for row in rows],
            [row[column(estimator, REAL)] for row in rows],
            LINES[bits],
            color=COLOURS[estimator],
            marker='o',
            label=f'{estimator}, {bits} bits',
        )
    axes.set(xscale='log', yscale='log', xlabel='joint states per second')
    axes.set(ylabel=f'RMS pitch error, {REAL} [mrad]')
    rates = sorted({row['joint states [Hz]'] for row in found['rows']})
    axes.set_xticks(rates, [f'{rate:g}' for rate in rates])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(loc='center left', bbox_to_anchor=(1.0, 0.5), frameon=False)
    save(figure, folder / 'sensing.png')
    return table(found['title'], found['rows'])
