"""Error over time per scan, by estimator and ego-motion, as last recorded."""

from pathlib import Path

import matplotlib.pyplot as plt
from rich.console import Console
from rich.table import Table

from bench.errors.ego_motion import FILTERED
from bench.shared.report import recorded, table
from figures.saving import save

TIMES, DISTANCES = [20, 50, 100, 200, 500, 1000], [10, 20, 50, 100]
MARKERS = {'off': 'o', 'per scan': 's', 'per beam': '^'}
COLOURS = {
    'nearest': 'tab:red',
    'ends': 'tab:orange',
    'slerp': 'tab:blue',
    'trajectory': 'tab:green',
}


def draw(folder: Path, _console: Console) -> Table:
    """Draw the recorded rows into estimators.png; return them."""
    found = recorded('estimators')
    figure, axes = plt.subplots(figsize=(7.5, 4.5))
    for row in found['rows']:
        estimator, motion = row['estimator'], row['ego-motion']
        axes.scatter(
            row['time per scan [us]'],
            row[FILTERED],
            color=COLOURS[estimator],
            marker=MARKERS[motion],
            s=60,
            label=f'{estimator}, ego-motion {motion}',
        )
    axes.set(xscale='log', yscale='log', xlabel='time per scan [µs]')
    axes.set(ylabel='RMS distance to the surfaces, filtered [mm]')
    axes.set_xticks(TIMES, map(str, TIMES))
    axes.set_yticks(DISTANCES, map(str, DISTANCES))
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(loc='center left', bbox_to_anchor=(1.0, 0.5), frameon=False)
    save(figure, folder / 'estimators.png')
    return table(found['title'], found['rows'])
