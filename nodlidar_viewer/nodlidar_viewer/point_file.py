"""The shown points as a PLY file."""

import io

import numpy as np
from numpy.lib.recfunctions import unstructured_to_structured
from numpy.typing import NDArray
from plyfile import PlyData, PlyElement


def ply_bytes(points: NDArray[np.float32], frame: str) -> bytes:
    """Return points [m], shape (n, 3), of a frame as a binary PLY file."""
    vertices = unstructured_to_structured(points, names=['x', 'y', 'z'])
    file = io.BytesIO()
    element = PlyElement.describe(vertices, 'vertex', comments=[f'frame {frame}'])
    PlyData([element], byte_order='<').write(file)
    return file.getvalue()
