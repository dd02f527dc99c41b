"""The folder of a map, as people name it: saved there, and loaded."""

from pathlib import Path

from nodlidar_common.errors import ParameterError
from nodlidar_common.whole_file import check_writable
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.graph.pose_graph import Edge
from nodlidar_mapper.output.grid import EmptyMapError, GridConfig, NO_SURFACE
from nodlidar_mapper.output.map_files import write_map
from nodlidar_mapper.output.saved_map import KEYFRAMES, load_keyframes, save_keyframes


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


def load(folder: Path) -> tuple[list[Keyframe], list[Edge]]:
    """Return the keyframes and edges of a saved map.

    Raises
    ------
    SavedMapError
        If the folder has no map, or a damaged one.
    ParameterError
        If the folder is in the home directory (~) of nobody.
    OSError
        With the path of a file that cannot be read.
    """
    # An error says where it was looked for.
    return load_keyframes(_expanded(folder).absolute() / KEYFRAMES)


def _expanded(folder: Path) -> Path:
    try:
        return folder.expanduser()
    except RuntimeError as error:
        raise ParameterError('folder', 'in a home directory that exists', str(folder)) from error
