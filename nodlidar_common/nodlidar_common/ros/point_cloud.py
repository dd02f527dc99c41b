"""The coordinates in a PointCloud2 message."""

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py.point_cloud2 import read_points

AXES = ('x', 'y', 'z')


def coordinates(message: PointCloud2) -> NDArray[np.float64]:
    """Return the coordinates of a cloud [m], shape (n, 3).

    Raises
    ------
    ValueError
        If the message is malformed.
    """
    try:
        points = read_points(message, field_names=AXES)
        columns = [np.ravel(points[axis]) for axis in AXES]
        return np.stack(columns, axis=1, dtype=np.float64)
    except (AssertionError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f'malformed cloud: {error}') from error
