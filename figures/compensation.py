"""Fig. 11: points over the height on a drive toward what is ahead, by the limits of the nod."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
from nodlidar_sim.world.scene import load_scene
import numpy as np
from rich.console import Console
from rich.table import Table

from bench.pitch_compensation import BINS, drive, DRIVES
from figures.saving import save

LIMITS = {'fixed': False, 'compensated': True}


def draw(folder: Path, console: Console) -> Table:
    """Draw points over the height into compensation.png; return how evenly they lie."""
    table = Table(title='Fig. 11: points over the height, coefficient of variation')
    for heading in ('scene', *LIMITS):
        table.add_column(heading, justify='right')
    figure, axes = plt.subplots(1, len(DRIVES), figsize=(9.0, 4.5), sharey=True)
    for shown, (name, start, end) in zip(axes, DRIVES, strict=True):
        variation = []
        for limits, compensate in LIMITS.items():
            with console.status(f'Fig. 11: {name}, {limits}'):
                points = drive(load_scene(name), start, end, compensate).points
            counts, _ = np.histogram(points[:, 2], bins=BINS)
            shown.stairs(counts / 1e3, BINS, orientation='horizontal', label=limits, linewidth=2)
            variation.append(f'{counts.std() / counts.mean():.3f}')
        table.add_row(name, *variation)
        shown.set(title=f"'{name}', {end - start:g} m", xlabel='thousands of points per 0.1 m')
    axes[0].set(ylabel='height [m]')
    axes[0].legend()
    save(figure, folder / 'compensation.png')
    return table
