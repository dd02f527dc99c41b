"""A picture of a map: its grid and the path."""

from importlib.util import find_spec
from pathlib import Path

from nodlidar_common.arrays import Array
from nodlidar_mapper.output.grid import FREE, Grid, OCCUPIED
import numpy as np

if find_spec('matplotlib') is None:  # said before a drive is mapped, not after it
    raise ModuleNotFoundError("No module named 'matplotlib'", name='matplotlib')

COLOURS = {FREE: 1.0, OCCUPIED: 0.0}
UNKNOWN_COLOUR = 0.8
SIZE, MARGIN, LEAST = 8.0, 0.6, 3.0  # longer side of the map, labels, whole picture [inches]


def write_picture(path: Path, grid: Grid, poses: Array) -> None:
    """Draw a grid and the poses (n, 4, 4) of a path in it."""
    # Imported here, since it takes as long as all other modules of the node.
    from matplotlib.figure import Figure

    shade = np.full(grid.cells.shape, UNKNOWN_COLOUR)
    for value, colour in COLOURS.items():
        shade[grid.cells == value] = colour
    x, y = grid.origin
    rows, columns = grid.cells.shape
    extent = (x, x + columns * grid.resolution, y, y + rows * grid.resolution)
    inches = SIZE * np.array([columns, rows]) / max(columns, rows)
    figure = Figure(figsize=tuple(np.maximum(inches + MARGIN, LEAST)), layout='constrained')
    axes = figure.subplots()
    axes.imshow(shade, cmap='gray', origin='lower', extent=extent, vmin=0.0, vmax=1.0)
    axes.plot(*poses[:, :2, 3].T, color='tab:red', linewidth=1.0, label='path')
    axes.plot(*poses[0, :2, 3], 'o', color='tab:red', label='start')
    axes.set(xlabel='x [m]', ylabel='y [m]', aspect='equal')
    axes.legend(loc='upper right')
    figure.savefig(path, dpi=120)
