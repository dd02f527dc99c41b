"""The points of a cloud: one NumPy record each, laid out as PointCloud2 carries them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Field order, types and the aligned 24-byte step are those that PCL-based consumers read fastest.
POINT = np.dtype(
    [
        ('x', np.float32),
        ('y', np.float32),
        ('z', np.float32),
        ('intensity', np.float32),
        ('time', np.float32),
        ('ring', np.uint16),
    ],
    align=True,
)

# Points in the frame of odometry. They have no `time`, by which a consumer would move them again.
MOVED_POINT = np.dtype(
    [(name, POINT[name]) for name in ('x', 'y', 'z', 'intensity', 'ring')], align=True
)

_FIELD_TYPES = {np.dtype(np.float32): 7, np.dtype(np.uint16): 4}  # as in PointField


def fields(point: np.dtype[np.void]) -> list[tuple[str, int, int, int]]:
    """Return name, offset [bytes], datatype and count of each PointField of points."""
    return [
        (name, offset, _FIELD_TYPES[dtype], 1)
        for name, (dtype, offset, *_) in (point.fields or {}).items()
    ]


def layout(data: NDArray[np.void]) -> dict[str, Any]:
    """Return the layout of an unorganised, dense PointCloud2 of points, but for its fields."""
    return {
        'height': 1,
        'width': len(data),
        'is_bigendian': False,
        'point_step': data.itemsize,
        'row_step': data.nbytes,
        'is_dense': True,
    }
