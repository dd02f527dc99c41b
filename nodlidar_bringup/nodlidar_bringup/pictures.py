"""A cloud as a PLY file and as a picture."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from plyfile import PlyData, PlyElement

VIEWS = (
    ('from above', 'x', 'y'),
    ('from the right', 'x', 'z'),
    ('from behind', 'y', 'z'),
)


def write_ply(points: NDArray[np.void], path: Path) -> None:
    """Write points, an array with the fields x, y, z and more, as binary PLY."""
    packed = np.empty(len(points), dtype=[(n, points.dtype[n]) for n in points.dtype.names or ()])
    for name in packed.dtype.names or ():
        packed[name] = points[name]
    PlyData([PlyElement.describe(packed, 'vertex')], byte_order='<').write(path)


def write_picture(points: NDArray[np.void], path: Path, title: str) -> None:
    """Draw points from above, from the right and from behind, coloured by height."""
    figure, axes = plt.subplots(1, 3, figsize=(18, 6.2), layout='constrained')
    low, high = np.percentile(points['z'], [1, 99])
    for axis, (name, across, up) in zip(axes, VIEWS, strict=True):
        drawn = axis.scatter(
            points[across],
            points[up],
            c=points['z'],
            s=0.4,
            cmap='turbo',
            vmin=low,
            vmax=high,
            linewidths=0,
        )
        axis.set(title=name, xlabel=f'{across} [m]', ylabel=f'{up} [m]', aspect='equal')
        axis.set_facecolor('#202226')
        if across == 'y':
            axis.invert_xaxis()  # seen from behind, left is left
    figure.colorbar(drawn, ax=axes, label='height above the nod axis [m]', shrink=0.8)
    figure.suptitle(title)
    figure.savefig(path, dpi=100)
    plt.close(figure)
