"""PointCloud2 messages as NumPy arrays."""

from array import array
import sys

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from underlay_refusal import refuse, refuse_arguments

__all__ = ['create_cloud', 'read_points']
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
    layout = _point_type(cloud.fields, cloud.point_step, '>' if cloud.is_bigendian else '<')
    points = np.ndarray(cloud.width * cloud.height, layout, buffer=cloud.data)
    return points if field_names is None else points[list(field_names)]


def _point_type(fields, point_step, order='='):
    if any(field.count != 1 for field in fields):
        raise NotImplementedError('fields of several values are not covered by the underlay')
    return np.dtype(
        {
            'names': [field.name for field in fields],
            'formats': [order + _TYPES[field.datatype] for field in fields],
            'offsets': [field.offset for field in fields],
            'itemsize': point_step,
        }
    )


def create_cloud(header, fields, points, point_step=None):
    """Return a message of an unorganised cloud; is_dense is False, as upstream.

    Parameters
    ----------
    header, fields
        Of the message.
    points
        A structured array (n,) of the type of the fields.
    point_step
        Bytes from point to point; None if the last field ends a point.
    """
    if getattr(points, 'dtype', None) is None or points.dtype.names is None or points.ndim != 1:
        raise NotImplementedError('only structured arrays (n,) are covered by the underlay')
    if point_step is None:
        point_step = max(f.offset + np.dtype(_TYPES[f.datatype]).itemsize for f in fields)
    assert points.dtype == _point_type(fields, point_step), (
        'PointFields and structured NumPy array dtype do not match for all fields!'
    )
    data = array('B')
    data.frombytes(np.ascontiguousarray(points).view(np.uint8).data)
    return PointCloud2(
        header=header,
        height=1,
        width=len(points),
        is_dense=False,
        is_bigendian=sys.byteorder != 'little',
        fields=fields,
        point_step=points.dtype.itemsize,
        row_step=points.nbytes,
        data=data,
    )
