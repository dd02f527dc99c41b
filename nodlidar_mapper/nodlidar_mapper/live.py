"""Maps while the robot drives: one call per cloud, with all that is to be published."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nodlidar_common.errors import ParameterError
from nodlidar_common.whole_file import check_writable
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import Array
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Estimate, Keyframe
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output.grid import EmptyMapError, Grid, grid_of, GridConfig, NO_SURFACE
from nodlidar_mapper.output.lasting import lasting_surface
from nodlidar_mapper.output.map_files import write_map
from nodlidar_mapper.output.saved_map import KEYFRAMES, load_keyframes, save_keyframes
import numpy as np

LEAST_COVARIANCE = np.diag([0.01**2] * 6)  # of a pose that a person set [m^2], [rad^2]
MOST_PLACES = 1000  # of a path; beyond it, every second one is forgotten


class LiveMapper:
    """A Mapper that remembers the path.

    Parameters
    ----------
    mapper
        An empty map, or one to be continued.
    """

    def __init__(self, mapper: Mapper) -> None:
        self.mapper = mapper
        self._path: list[Estimate] = []

    def place(self, pose: Array, stamp_ns: int, odometry: Array, covariance: Array) -> None:
        """Continue at a given pose, see Mapper.place."""
        self.mapper.place(pose, stamp_ns, odometry, covariance + LEAST_COVARIANCE)

    def add(self, cloud: Cloud) -> MapSnapshot:
        """Match a cloud, see Mapper.add; return what is known then."""
        self._path.append(self.mapper.add(cloud))
        if len(self._path) > MOST_PLACES:
            del self._path[1:-1:2]
        return self.mapper.snapshot(self._path)


def surface_and_grid(
    keyframes: Sequence[Keyframe], config: GridConfig
) -> tuple[Surface, Grid] | None:
    """Return the lasting surfaces and the grid of a map; None without any surface."""
    surface = lasting_surface(keyframes)
    try:
        return surface, grid_of(surface, keyframes, config)
    except EmptyMapError:
        return None


def save(
    folder: Path, snapshot: MapSnapshot | None, config: GridConfig, with_keyframes: bool = True
) -> str:
    """Save a map, its keyframes unless they were saved before; return what was saved, in words.

    Raises
    ------
    EmptyMapError
        If there is nothing to save.
    ParameterError
        If the folder is in the home directory (~) of nobody.
    OSError
        With the folder, if a file cannot be written.
    """
    if snapshot is None:
        raise EmptyMapError('nothing to save: no cloud was matched since the start or load_map')
    folder = _expanded(folder)
    surface = write_map(folder, snapshot, config, with_keyframes)
    what = f'{len(snapshot.keyframes)} keyframes and {len(surface.points)} points'
    return f"{what} saved in '{folder.absolute()}'"


def save_keyframes_of(folder: Path, snapshot: MapSnapshot) -> None:
    """Save that of a map from which mapping goes on, which takes a moment; raises as `save`."""
    if not any(len(each.surface.points) for each in snapshot.keyframes):
        raise EmptyMapError(NO_SURFACE)
    folder = _expanded(folder)
    folder.mkdir(parents=True, exist_ok=True)
    save_keyframes(folder / KEYFRAMES, snapshot.keyframes, snapshot.edges)


def make_parent(parent: Path) -> None:
    """Make a folder in which maps can be saved; raise OSError, or ParameterError as `save`."""
    parent = _expanded(parent)
    parent.mkdir(parents=True, exist_ok=True)
    check_writable(parent / KEYFRAMES)


def load(folder: Path, config: MapConfig) -> LiveMapper:
    """Return the mapper of a saved map, in which the robot may be anywhere.

    Raises
    ------
    SavedMapError
        If the folder has no map, or a damaged one.
    ParameterError
        If the folder is in the home directory (~) of nobody.
    OSError
        With the path of a file that cannot be read.
    """
    path = _expanded(folder).absolute() / KEYFRAMES  # an error says where it was looked for
    return LiveMapper(Mapper(config, *load_keyframes(path)))


def continued(snapshot: MapSnapshot, config: MapConfig) -> LiveMapper:
    """Return the mapper of the map as it was after a cloud; the robot may be anywhere in it."""
    return LiveMapper(Mapper(config, snapshot.keyframes, snapshot.edges))


def _expanded(folder: Path) -> Path:
    try:
        return folder.expanduser()
    except RuntimeError as error:
        raise ParameterError('folder', 'in a home directory that exists', str(folder)) from error
