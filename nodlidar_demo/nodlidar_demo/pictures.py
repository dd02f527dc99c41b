"""A picture of a cloud."""

from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from nodlidar_common.arrays import Array
from nodlidar_common.whole_file import whole_file
import numpy as np

BACKGROUND = '#16181c'
# Neither end of the colours is as dark as the background.
COLOURS = ListedColormap(matplotlib.colormaps['turbo'](np.linspace(0.1, 0.93, 256)))
# The perspective view: from over the sensor's right shoulder, in nodlidar_base_link [m].
EYE, TARGET = np.array([-1.3, -0.7, 0.9]), np.array([2.0, 0.0, -0.1])
NEAREST = 0.5
# Share of the cloud's extent that the other views omit at each end of their line of sight: the
# ceiling would hide the room from above, a wall from the side.
LEFT_OUT = 0.05


def write_picture(xyz: Array, path: Path, title: str) -> None:
    """Write `picture` as a PNG file; raises OSError if it cannot be written."""
    with whole_file(path) as part:
        FigureCanvasAgg(picture(xyz, title)).print_figure(part, dpi=100)


def picture(xyz: Array, title: str) -> Figure:
    """Draw points (n, 3) in perspective, from above and from the right, coloured by height."""
    figure = Figure(figsize=(18, 8), layout='constrained')
    axes: dict[str, Axes] = figure.subplot_mosaic(
        [['perspective', 'above'], ['perspective', 'right']],
        width_ratios=[2.7, 1],
        height_ratios=[2.1, 1],
    )
    axes['right'].sharex(axes['above'])
    heights = Normalize(*np.percentile(xyz[:, 2], [1, 99]))
    drawn = _draw_perspective(axes['perspective'], xyz, heights)
    _draw_along(axes['above'], xyz, 'xyz', heights, 'from above')
    # Seen from the right, the line of sight is y, and the left wall is the far one.
    _draw_along(axes['right'], xyz * (1, -1, 1), 'xzy', heights, 'from the right')
    figure.colorbar(drawn, ax=[*axes.values()], label='height above the nod axis [m]', pad=0.01)
    figure.suptitle(title)
    return figure


def seen_from(xyz: Array, eye: Array, target: Array) -> Array:
    """Project points onto an upright camera at `eye` that points at `target`, shape (n, 3).

    The columns are right and up, as tangents of the angles from the optical axis, and depth [m].
    """
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    across, up, depth = np.stack([right, np.cross(right, ahead), ahead]) @ (xyz - eye).T
    return np.stack([across / depth, up / depth, depth], axis=1)


def _draw_perspective(axes: Axes, xyz: Array, heights: Normalize) -> PathCollection:
    in_front = (xyz - EYE) @ (TARGET - EYE) > NEAREST * np.linalg.norm(TARGET - EYE)
    across, up, depth = seen_from(xyz[in_front], EYE, TARGET).T
    axes.set(title='from behind the sensor', xticks=[], yticks=[])
    axes.set(xlim=(-0.85, 0.85), ylim=(-0.42, 0.5))
    return _draw(axes, across, up, -depth, xyz[in_front, 2], heights, 16.0 / depth**2)


def _draw_along(axes: Axes, xyz: Array, names: str, heights: Normalize, title: str) -> None:
    """Draw points seen along the last of three named axes, without both ends of it."""
    across, up, toward = (xyz[:, 'xyz'.index(name)] for name in names)
    low, high = np.percentile(toward, [1, 99])
    margin = LEFT_OUT * (high - low)
    kept = (toward > low + margin) & (toward < high - margin)
    size = np.full(len(xyz), 0.9)
    _draw(axes, across[kept], up[kept], toward[kept], xyz[kept, 2], heights, size[kept])
    axes.plot(0.0, 0.0, '+', color='white', markersize=9)
    axes.set(title=f'{title}\n(outer {LEFT_OUT:.0%} of {names[2]} left out)')
    axes.set(xlabel=f'{names[0]} [m]', ylabel=f'{names[1]} [m]')


def _draw(
    axes: Axes,
    across: Array,
    up: Array,
    toward: Array,
    height: Array,
    heights: Normalize,
    size: Array,
) -> PathCollection:
    """Draw points, the nearer ones over the others."""
    order = np.argsort(toward)
    axes.set(aspect='equal', facecolor=BACKGROUND)
    return axes.scatter(
        across[order],
        up[order],
        c=height[order],
        s=size[order],
        cmap=COLOURS,
        norm=heights,
        linewidths=0,
    )
