"""PointCloud2 messages from and to NumPy arrays."""

import array
from collections import namedtuple
import sys

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured, unstructured_to_structured
from sensor_msgs.msg import PointCloud2, PointField
from underlay_refusal import refuse

__all__ = [
    'create_cloud',
    'create_cloud_xyz32',
    'dtype_from_fields',
    'read_points',
    'read_points_list',
    'read_points_numpy',
]
__getattr__ = refuse(__name__, __all__)

_TYPES = {
    PointField.INT8: np.dtype(np.int8),
    PointField.UINT8: np.dtype(np.uint8),
    PointField.INT16: np.dtype(np.int16),
    PointField.UINT16: np.dtype(np.uint16),
    PointField.INT32: np.dtype(np.int32),
    PointField.UINT32: np.dtype(np.uint32),
    PointField.FLOAT32: np.dtype(np.float32),
    PointField.FLOAT64: np.dtype(np.float64),
}


def read_points(cloud, field_names=None, skip_nans=False, uvs=None, reshape_organized_cloud=False):
    """Return a cloud's points as a structured array, a view of the message where that can be.

    Parameters
    ----------
    cloud
        A PointCloud2.
    field_names
        The fields wanted, in their order; None for all.
    skip_nans
        Leave out points with a NaN in a wanted field; does nothing if the cloud is dense.
    uvs
        Indices of the points wanted, counted after NaNs were left out; None for all.
    reshape_organized_cloud
        Give an organized cloud as an array of shape (width, height), as :func:`create_cloud`
        takes it. (By the message's definition the rows come first.)
    """
    assert isinstance(cloud, PointCloud2), 'Cloud is not a sensor_msgs.msg.PointCloud2'
    dtype = dtype_from_fields(cloud.fields, point_step=cloud.point_step)
    points = np.ndarray(cloud.width * cloud.height, dtype, buffer=cloud.data)
    if field_names is not None:
        missing = set(field_names) - set(points.dtype.names)
        assert not missing, f'Requested fields are not in the fields of the cloud: {missing}'
        points = points[list(field_names)]
    if cloud.is_bigendian != (sys.byteorder == 'big'):
        points = points.byteswap()
    if skip_nans and not cloud.is_dense:
        has_nan = np.any([np.isnan(points[name]) for name in points.dtype.names], axis=0)
        points = points[~has_nan]
    if uvs is not None:
        points = points[uvs if isinstance(uvs, np.ndarray) else np.fromiter(uvs, int)]
    if reshape_organized_cloud and cloud.height > 1:
        points = points.reshape(cloud.width, cloud.height)
    return points


def read_points_numpy(
    cloud, field_names=None, skip_nans=False, uvs=None, reshape_organized_cloud=False
):
    """Return a cloud's points as an array of shape (points, fields); see :func:`read_points`.

    The fields wanted must be of one type, that of the cloud's first field.
    """
    wanted = [f for f in cloud.fields[1:] if field_names is None or f.name in field_names]
    _check_one_type(cloud.fields[:1] + wanted)
    points = read_points(cloud, field_names, skip_nans, uvs, reshape_organized_cloud)
    return structured_to_unstructured(points)


def read_points_list(cloud, field_names=None, skip_nans=False, uvs=None):
    """Return a cloud's points as a list of named tuples; slow."""
    assert isinstance(cloud, PointCloud2), 'cloud is not a sensor_msgs.msg.PointCloud2'
    names = [f.name for f in cloud.fields] if field_names is None else field_names
    point = namedtuple('Point', names)
    return [point._make(each) for each in read_points(cloud, names, skip_nans, uvs)]


def dtype_from_fields(fields, point_step=None):
    """Return the NumPy type of points with these fields.

    A field of several values becomes as many fields, ``name_0`` and so on; one without a name is
    called ``unnamed_field_`` and its number. `point_step` is the size of a point in bytes.
    """
    names, formats, offsets = [], [], []
    for number, field in enumerate(fields):
        assert field.count > 0, "Can't process fields with count = 0."
        name = field.name or f'unnamed_field_{number}'
        kind = _TYPES[field.datatype]
        for i in range(field.count):
            names.append(f'{name}_{i}' if field.count > 1 else name)
            formats.append(kind.str)
            offsets.append(field.offset + i * kind.itemsize)
    assert len(names) == len(set(names)), f'Duplicate field names are not allowed: {names}'
    layout = {'names': names, 'formats': formats, 'offsets': offsets}
    return np.dtype(layout if point_step is None else {**layout, 'itemsize': point_step})


def create_cloud(header, fields, points, point_step=None):
    """Return a PointCloud2.

    Parameters
    ----------
    header, fields
        The message's header and list of PointField.
    points
        A structured array of just these fields; or an unstructured one whose last axis is the
        fields, all of one type; or an iterable of points. An array of points of shape
        (width, height) makes an organized cloud.
    point_step
        Size of a point in bytes; by default as the fields need.

    The cloud is never marked as dense, even if it is.
    """
    dtype = dtype_from_fields(fields, point_step)
    if not isinstance(points, np.ndarray):
        points = np.array([tuple(point) for point in points], dtype=dtype)
    elif points.dtype.names is None:
        _check_one_type(fields)
        points = unstructured_to_structured(points, dtype=dtype)
    assert points.dtype == dtype, (
        f'PointFields and structured NumPy array do not match: {dtype} and {points.dtype}'
    )
    assert points.ndim <= 2, f'Points must be in one or two dimensions, not {points.ndim}'
    width, height = points.shape if points.ndim == 2 else (points.shape[0], 1)
    cloud = PointCloud2(
        header=header,
        height=height,
        width=width,
        is_bigendian=sys.byteorder == 'big',
        is_dense=False,
        fields=fields,
        point_step=dtype.itemsize,
        row_step=dtype.itemsize * width,
    )
    # Handed over after construction as a whole, since the constructor goes through every byte.
    data = array.array('B')
    data.frombytes(memoryview(points).cast('B'))
    cloud.data = data
    return cloud


def create_cloud_xyz32(header, points):
    """Return a PointCloud2 of x, y, z as FLOAT32."""
    fields = [
        PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
        for i, name in enumerate('xyz')
    ]
    return create_cloud(header, fields, points)


def _check_one_type(fields):
    assert len({field.datatype for field in fields}) <= 1, (
        'All fields need to have the same datatype; use structured points otherwise.'
    )
