"""The points in a PointCloud2 message."""

from nodlidar_common.arrays import Array
import numpy as np
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py.point_cloud2 import read_points

AXES, AGE = ('x', 'y', 'z'), 'age'


def coordinates(message: PointCloud2) -> Array:
    """Return the coordinates of a cloud [m], shape (n, 3).

    Raises
    ------
    ValueError
        If the message is malformed.
    """
    return points_in(message)[0]


def points_in(message: PointCloud2) -> tuple[Array, Array | None]:
    """Return coordinates [m], shape (n, 3), and age of points at the stamp [s], shape (n,).

    The age is that of deskewed clouds, None in others.

    Raises
    ------
    ValueError
        If the message is malformed.
    """
    if message.height > 1 and message.row_step != message.width * message.point_step:
        # read_points would take it for points.
        raise ValueError('malformed cloud: there is something between its rows')
    has_age = any(field.name == AGE for field in message.fields)
    try:
        points = read_points(message, field_names=(*AXES, AGE) if has_age else AXES)
        columns = [np.ravel(points[axis]) for axis in AXES]
        age = np.ravel(points[AGE]).astype(np.float64) if has_age else None
        return np.stack(columns, axis=1, dtype=np.float64), age
    except (AssertionError, KeyError, NotImplementedError, TypeError, ValueError) as error:
        raise ValueError(f'malformed cloud: {error}') from error
