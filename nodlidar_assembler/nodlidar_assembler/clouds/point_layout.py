"""The points of a cloud: one NumPy record each, laid out as in PointCloud2."""

from typing import Any

from nodlidar_common.arrays import Array
import numpy as np
from numpy.typing import NDArray

# PCL-based consumers read this order, these types and the aligned 24-byte step fastest.
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

# Points in the frame of odometry, without `time`, so that no consumer deskews them again.
MOVED_POINT = np.dtype(
    [(name, POINT[name]) for name in ('x', 'y', 'z', 'intensity', 'ring')], align=True
)

# Deskewed points with their age at the stamp [s], a name that no consumer takes for a time.
DESKEWED_POINT = np.dtype(
    [('age' if name == 'time' else name, POINT[name]) for name in POINT.names or ()], align=True
)

# The same with the expected error of each point [m], behind the other fields.
WITH_SIGMA = {
    point: np.dtype(
        [*((name, point[name]) for name in point.names or ()), ('sigma', np.float32)], align=True
    )
    for point in (POINT, MOVED_POINT, DESKEWED_POINT)
}

_FIELD_TYPES = {np.dtype(np.float32): 7, np.dtype(np.uint16): 4}  # as in PointField


def fields(point: np.dtype[np.void]) -> list[tuple[str, int, int, int]]:
    """Return name, offset [bytes], datatype and count of each PointField of a point type."""
    return [
        (name, offset, _FIELD_TYPES[dtype], 1)
        for name, (dtype, offset, *_) in (point.fields or {}).items()
    ]


def xyz_in(data: NDArray[np.void]) -> Array:
    """Return the coordinates of points of any type [m], shape (n, 3)."""
    return np.stack([data[axis] for axis in 'xyz'], axis=1, dtype=np.float64)


def layout(data: NDArray[np.void]) -> dict[str, Any]:
    """Return the layout of an unorganised, dense PointCloud2 of points, without its fields."""
    return {
        'height': 1,
        'width': len(data),
        'is_bigendian': False,
        'point_step': data.itemsize,
        'row_step': data.nbytes,
        'is_dense': True,
    }
