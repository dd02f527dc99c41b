"""Writes a map: points as PLY, a grid as map_server reads it, keyframes, the path as TUM."""

from collections.abc import Sequence
from pathlib import Path

from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.whole_file import whole_files
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.output.grid import FREE, Grid, GridConfig, OCCUPIED, surface_and_grid
from nodlidar_mapper.output.picture import write_picture
from nodlidar_mapper.output.saved_map import KEYFRAMES, save_keyframes
import numpy as np
from numpy.lib.recfunctions import unstructured_to_structured
from plyfile import PlyData, PlyElement
from scipy.spatial.transform import Rotation
import yaml

GREY = {FREE: 254, OCCUPIED: 0}  # as map_saver of nav2 writes them; 205 where unknown
UNKNOWN_GREY = 205
AXES = ('x', 'y', 'z', 'nx', 'ny', 'nz')


def write_map(
    folder: Path, snapshot: MapSnapshot, config: GridConfig, with_keyframes: bool = True
) -> Surface:
    """Write a map and the path into a folder, all files or none; return its surfaces.

    The keyframes may have been written before.

    Raises
    ------
    OSError
        With the folder, if a file cannot be written.
    EmptyMapError
        If there is no surface.
    """
    surface, grid = surface_and_grid(snapshot.keyframes, config)
    with whole_files(folder) as part:
        write_surface(part / 'map.ply', surface)
        write_grid(part, grid)
        write_path(part / 'trajectory.txt', snapshot.stamps_ns, snapshot.path)
        if with_keyframes:
            save_keyframes(part / KEYFRAMES, snapshot.keyframes, snapshot.edges)
        write_picture(part / 'map.png', grid, snapshot.path)
    return surface


def write_surface(path: Path, surface: Surface) -> None:
    """Write points and normals as a binary PLY file."""
    values = np.concatenate([surface.points, surface.normals], axis=1)
    vertices = unstructured_to_structured(values, np.dtype([(axis, '<f4') for axis in AXES]))
    PlyData([PlyElement.describe(vertices, 'vertex')]).write(str(path))


def write_grid(folder: Path, grid: Grid) -> None:
    """Write map.pgm and map.yaml, which map_server of nav2 reads."""
    grey = np.full(grid.cells.shape, UNKNOWN_GREY, dtype=np.uint8)
    for value, shade in GREY.items():
        grey[grid.cells == value] = shade
    rows, columns = grey.shape
    header = f'P5\n{columns} {rows}\n255\n'
    (folder / 'map.pgm').write_bytes(header.encode() + grey[::-1].tobytes())
    description = {
        'image': 'map.pgm',
        'mode': 'trinary',
        'resolution': grid.resolution,
        'origin': [*grid.origin, 0.0],
        'negate': 0,
        'occupied_thresh': 0.65,
        'free_thresh': 0.196,  # UNKNOWN_GREY is 50 / 255 = 0.1961
    }
    (folder / 'map.yaml').write_text(yaml.safe_dump(description, sort_keys=False))


def write_path(path: Path, stamps_ns: Sequence[int], poses: Array) -> None:
    """Write poses (n, 4, 4) as lines of time [s], x, y, z [m] and quaternion x, y, z, w."""
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    with path.open('w') as file:
        for stamp_ns, position, turn in zip(stamps_ns, poses[:, :3, 3], quaternions, strict=True):
            seconds, rest = divmod(stamp_ns, NS_PER_S)
            values = ' '.join(f'{value:.6f}' for value in (*position, *turn))
            file.write(f'{seconds}.{rest:09d} {values}\n')
