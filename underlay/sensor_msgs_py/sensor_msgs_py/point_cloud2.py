"""PointCloud2 messages as NumPy arrays."""

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured
from sensor_msgs.msg import PointField
from underlay_refusal import refuse, refuse_arguments

__all__ = ['read_points', 'read_points_numpy']
__getattr__ = refuse(__name__, __all__)

_TYPES = {
    PointField.INT8: 'i1',
    PointField.UINT8: 'u1',
    PointField.INT16: 'i2',
    PointField.UINT16: 'u2',
    PointField.INT32: 'i4',
    PointField.UINT32: 'u4',
    PointField.FLOAT32: 'f4',
    PointField.FLOAT64: 'f8',
}


def read_points(cloud, field_names=None, **uncovered):
    """Return a cloud's points as a structured array, a view of the message.

    Parameters
    ----------
    cloud
        A PointCloud2 whose fields have a single value each.
    field_names
        The fields wanted, in their order; None for all.
    """
    refuse_arguments('read_points', uncovered)
    if any(field.count != 1 for field in cloud.fields):
        raise NotImplementedError('fields of several values are not covered by the underlay')
    order = '>' if cloud.is_bigendian else '<'
    layout = {
        'names': [field.name for field in cloud.fields],
        'formats': [order + _TYPES[field.datatype] for field in cloud.fields],
        'offsets': [field.offset for field in cloud.fields],
        'itemsize': cloud.point_step,
    }
    points = np.ndarray(cloud.width * cloud.height, np.dtype(layout), buffer=cloud.data)
    return points if field_names is None else points[list(field_names)]


def read_points_numpy(cloud, field_names=None, **uncovered):
    """Return a cloud's points as an array of shape (points, fields); see :func:`read_points`.

    The fields wanted must be of one type.
    """
    points = read_points(cloud, field_names, **uncovered)
    assert len({points.dtype[name] for name in points.dtype.names}) == 1, (
        'All fields need to have the same datatype; use read_points otherwise.'
    )
    return structured_to_unstructured(points)
