"""Fig. 11: points over the height on a drive toward an object ahead, by the nod's limits."""

from pathlib import Path

import matplotlib.pyplot as plt
from nodlidar_sim.world.scene import load_scene
import numpy as np
from rich.console import Console
from rich.table import Table

from bench.nod.pitch_compensation import ARMS, BINS, drive, DRIVES, variation
from bench.shared.report import Row, table
from figures.saving import save


def draw(folder: Path, console: Console) -> Table:
    """Draw points over the height into compensation.png; return how evenly they lie."""
    rows: list[Row] = []
    figure, axes = plt.subplots(1, len(DRIVES), figsize=(9.0, 4.5), sharey=True)
    for shown, (name, start, end) in zip(axes, DRIVES, strict=True):
        row: Row = {'scene': name}
        for limits in ARMS:
            with console.status(f'Fig. 11: {name}, {limits}'):
                points = drive(load_scene(name), start, end, limits).points
            counts, _ = np.histogram(points[:, 2], bins=BINS)
            shown.stairs(counts / 1e3, BINS, orientation='horizontal', label=limits, linewidth=2)
            row[limits] = variation(points)
        rows.append(row)
        title = f"'{name}', a drive of {end - start:g} m"
        shown.set(title=title, xlabel='thousands of points per 0.1 m')
    axes[0].set(ylabel='height [m]')
    axes[0].legend()
    save(figure, folder / 'compensation.png')
    return table('Fig. 11: points over the height, coefficient of variation', rows)
