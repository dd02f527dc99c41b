"""Drives a simulated building and maps it, many times faster than real time.

Leaves in the output folder a bag of the drive, the map (map.ply, map.pgm, map.yaml,
keyframes.npz), the path, and a picture of the map beside the true floor plan.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.whole_file import named, whole_file
from nodlidar_demo.options import check_duration, new_bag
from nodlidar_mapper.commands.map_bag import main as map_bag
from nodlidar_mapper.geometry.poses import moved, planar
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
from rich.console import Console
import yaml

START_NS = 1_700_000_000 * NS_PER_S
SIMULATED_RATE = 10_240  # steps of the lidar per second
CELL = 0.05  # of the floor plan [m]
HEIGHTS = np.arange(0.2, 1.8, 0.4)  # at which the floor plan shows surfaces [m]
WALL = 0.04  # distance from a surface within which a cell is one [m]


def main(argv: Sequence[str] | None) -> None:
    """Simulate a drive, map it and draw the map beside the truth.

    Raises
    ------
    NodlidarError
        If the scene or an option is not allowed.
    OSError
        If a file cannot be written.
    """
    options = _parse(argv)
    console = Console(stderr=True)
    scene = load_scene(options.scene, options.route)
    profile = PROFILES['slam']
    n_s = profile.samples_per_sweep
    nod = Nod(profile.pitch_min, profile.pitch_max, n_s / SIMULATED_RATE, n_s, START_NS)
    output: Path = options.output
    driving = f'driving {options.duration:.0f} s through {options.scene}'
    with new_bag(output) as bag, console.status(driving):
        drive = simulate(scene, nod, options.duration, options.seed, start_ns=START_NS)
        with named(bag):
            write_bag(drive, bag)
    map_bag([str(bag), str(output)])
    with console.status('drawing'):
        write_comparison(output / 'floor_plan.png', output, drive)


def write_comparison(path: Path, folder: Path, drive: Recording) -> None:
    """Draw a map of a folder beside the floor plan of its drive, with both paths."""
    lines = np.loadtxt(folder / 'trajectory.txt', ndmin=2)
    start = drive.world.scene.base_start
    true = drive.true_pose[:, :2]  # from where it began
    figure = Figure(figsize=(15.0, 7.5), layout='constrained')
    mapped, plan = figure.subplots(1, 2, sharex=True, sharey=True)
    _draw_map(mapped, folder)
    _draw_plan(plan, drive, start, (*mapped.get_xlim(), *mapped.get_ylim()))
    for axes, driven, title in ((mapped, lines[:, 1:3], 'map'), (plan, true, 'true floor plan')):
        axes.plot(*driven.T, color='tab:red', linewidth=1.0)
        axes.set(xlabel='x [m]', ylabel='y [m]', aspect='equal', title=title)
    with whole_file(path) as part:
        FigureCanvasAgg(figure).print_figure(part, dpi=80)


def _draw_map(axes: Axes, folder: Path) -> None:
    grid = yaml.safe_load((folder / 'map.yaml').read_text())
    grey = imread(folder / grid['image'])
    (x, y, _), size = grid['origin'], grid['resolution']
    extent = (x, x + size * grey.shape[1], y, y + size * grey.shape[0])
    axes.imshow(grey, cmap='gray', extent=extent, vmin=0, vmax=255)


def _draw_plan(
    axes: Axes,
    drive: Recording,
    start: Sequence[float],
    extent: tuple[float, float, float, float],
) -> None:
    """Draw where a scene has surfaces, in the frame of the map, which begins at the start."""
    left, right, bottom, top = extent
    x, y = np.meshgrid(np.arange(left, right, CELL), np.arange(bottom, top, CELL))
    at = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    world = moved(planar(*start), at)
    nearest = np.full(len(at), np.inf)
    for height in HEIGHTS:
        world[:, 2] = height
        np.minimum(nearest, drive.world.scene.surfaces.surface_distance(world), out=nearest)
    wall = (nearest < WALL).reshape(x.shape)
    axes.imshow(~wall, cmap='gray', origin='lower', extent=extent, vmin=0, vmax=1)


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('demo_mapping', __doc__)
    parser.add_argument('--scene', default='building', help='scene, or a YAML file')
    parser.add_argument('--route', default=None, help="route in place of the scene's own")
    parser.add_argument('--duration', type=float, default=200.0, help='duration of the drive [s]')
    parser.add_argument('--seed', type=int, default=1, help='seed of the noise')
    parser.add_argument(
        '--output', type=Path, default=Path('mapping_output'), help='folder to write to'
    )
    options = parser.parse_args(argv)
    check_duration(options.duration)
    if options.seed < 0:
        raise ParameterError('--seed', 'at least 0', options.seed)
    return options
