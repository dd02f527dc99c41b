"""The keyframes of a map in a file, so that mapping can go on."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from nodlidar_common.arrays import Array
from nodlidar_common.errors import NodlidarError
from nodlidar_common.whole_file import named, whole_file
from nodlidar_mapper.geometry.poses import inverse
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.pose_graph import Edge
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

KEYFRAMES = 'keyframes.npz'  # name of the file
FORMAT = 2
ROUNDING = 1e-4  # of matrices and normals, at most
# Points of all keyframes one after the other; `*_counts` are the numbers of each.
SHAPES: dict[str, tuple[int | str, ...]] = {
    'stamp_ns': ('keyframes',),
    'pose': ('keyframes', 4, 4),
    'robot': ('keyframes', 4, 4),
    'surface_counts': ('keyframes',),
    'surface': ('surface', 6),
    'cloud_counts': ('keyframes',),
    'cloud': ('cloud', 6),
    'edge': ('edges', 2),
    'relative': ('edges', 4, 4),
    'information': ('edges', 6, 6),
}


class SavedMapError(NodlidarError):
    """A file that is no map."""


def save_keyframes(path: Path, keyframes: Sequence[Keyframe], edges: Sequence[Edge]) -> None:
    """Write a map.

    Parameters
    ----------
    path
        An .npz file.
    keyframes, edges
        Of a map with one keyframe at least.
    """
    surfaces = [np.hstack([k.surface.points, k.surface.normals]) for k in keyframes]
    clouds = [np.hstack([k.cloud.points, k.cloud.origins]) for k in keyframes]
    arrays = {
        'format': np.array(FORMAT),
        'stamp_ns': np.array([k.stamp_ns for k in keyframes], dtype=np.int64),
        'pose': np.stack([k.pose for k in keyframes]),
        'robot': np.stack([k.robot for k in keyframes]),
        'surface_counts': np.array([len(each) for each in surfaces], dtype=np.int64),
        'surface': np.concatenate(surfaces).astype(np.float32),
        'cloud_counts': np.array([len(each) for each in clouds], dtype=np.int64),
        'cloud': np.concatenate(clouds).astype(np.float32),
        'edge': np.array([(e.start, e.end) for e in edges], dtype=np.int64).reshape(-1, 2),
        'relative': np.array([e.relative for e in edges]).reshape(-1, 4, 4),
        'information': np.array([e.information for e in edges]).reshape(-1, 6, 6),
    }
    content = BytesIO()  # on a full disk, zipfile would close its file again and again
    np.savez_compressed(content, **arrays)
    with whole_file(path) as part:
        # Not a view of the content: if this fails, Python 3.12.1 crashes as it collects the view.
        part.write_bytes(content.getvalue())


def load_keyframes(path: Path) -> tuple[list[Keyframe], list[Edge]]:
    """Return the keyframes and edges of a map.

    Raises
    ------
    SavedMapError
        If the file is not a map of this version, or is damaged.
    OSError
        With the path, if it cannot be read.
    """
    if path.exists() and not path.is_file():  # reading a pipe might never end
        raise SavedMapError(f"'{path}' is not a map: it is no file")
    with named(path):
        content = BytesIO(path.read_bytes())
    try:
        with np.load(content, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        _check(arrays)
    except Exception as error:  # of zipfile, zlib or NumPy, which do not say which
        raise SavedMapError(f"'{path}' is not a map: {error}") from error
    surfaces = _parts(arrays['surface'], arrays['surface_counts'])
    clouds = _parts(arrays['cloud'], arrays['cloud_counts'])
    keyframes = [
        Keyframe(
            int(stamp_ns),
            pose,
            Surface(surface[:, :3], surface[:, 3:]),
            Seen(cloud[:, :3], cloud[:, 3:]),
            robot,
        )
        for stamp_ns, pose, robot, surface, cloud in zip(
            arrays['stamp_ns'], arrays['pose'], arrays['robot'], surfaces, clouds, strict=True
        )
    ]
    edges = [
        Edge(int(start), int(end), relative, information)
        for (start, end), relative, information in zip(
            arrays['edge'], arrays['relative'], arrays['information'], strict=True
        )
    ]
    return keyframes, edges


def _parts(points: NDArray[Any], counts: NDArray[Any]) -> list[Array]:
    return np.split(points.astype(np.float64), np.cumsum(counts)[:-1])


def _check(arrays: dict[str, NDArray[Any]]) -> None:
    """Raise ValueError or KeyError unless the arrays are a map."""
    if arrays['format'].tolist() != FORMAT:
        raise ValueError(f'its format is {arrays["format"]}, not {FORMAT}')
    sizes = {
        'keyframes': len(arrays['stamp_ns']),
        'surface': int(arrays['surface_counts'].sum()),
        'cloud': int(arrays['cloud_counts'].sum()),
        'edges': len(arrays['edge']),
    }
    if not sizes['keyframes']:
        raise ValueError('it has no keyframe')
    for name, shape in SHAPES.items():
        wanted = tuple(sizes.get(n, n) if isinstance(n, str) else n for n in shape)
        kind = np.integer if name.endswith(('_ns', '_counts')) or name == 'edge' else np.floating
        if arrays[name].shape != wanted or not np.issubdtype(arrays[name].dtype, kind):
            raise ValueError(f'{name} is {arrays[name].dtype} of {arrays[name].shape}')
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f'{name} is not finite')
    _check_values(arrays)


def _check_values(arrays: dict[str, NDArray[Any]]) -> None:
    """Raise ValueError unless arrays of the right shapes can be of a map."""
    counts = np.concatenate([arrays['surface_counts'], arrays['cloud_counts']])
    ends = arrays['edge']
    if (counts < 0).any() or (ends < 0).any() or (ends >= len(arrays['stamp_ns'])).any():
        raise ValueError('an index or a count is out of range')
    for name in ('pose', 'robot', 'relative'):
        off = inverse(arrays[name]) @ arrays[name] - np.eye(4)
        if (np.abs(off) > ROUNDING).any() or (np.linalg.det(arrays[name]) < 0.0).any():
            raise ValueError(f'{name} is not rigid')
    length = np.linalg.norm(arrays['surface'][:, 3:], axis=1)
    if (np.abs(length - 1.0) > ROUNDING).any():
        raise ValueError('a normal of surface is not of length 1')
    information = arrays['information']
    largest = np.abs(information).max(axis=(1, 2), initial=0.0)
    skew = np.abs(information - np.swapaxes(information, 1, 2)).max(axis=(1, 2), initial=0.0)
    least = np.linalg.eigvalsh(information)[:, 0]
    if (np.maximum(skew, -least) > ROUNDING * largest).any():
        raise ValueError('information is not symmetric and positive')
    count = len(arrays['stamp_ns'])
    joins = csr_matrix((np.ones(len(ends)), (*ends.T,)), shape=(count, count))
    if connected_components(joins, directed=False, return_labels=False) > 1:
        raise ValueError('edges do not join all keyframes')
