import struct
import sys

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField
from sensor_msgs_py.point_cloud2 import (
    create_cloud,
    create_cloud_xyz32,
    dtype_from_fields,
    read_points,
    read_points_list,
    read_points_numpy,
)
from std_msgs.msg import Header

HEADER = Header(frame_id='laser')
FIELDS = [
    PointField(name='x', offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name='ring', offset=4, datatype=PointField.UINT16, count=1),
    PointField(name='time', offset=8, datatype=PointField.FLOAT64, count=1),
]
POINTS = [(1.5, 7, 0.25), (-2.0, 65535, float('nan')), (3.0, 0, 1e-9)]


@pytest.fixture
def cloud():
    return create_cloud(HEADER, FIELDS, POINTS)


def test_bytes_are_those_of_the_fields(cloud):
    assert (cloud.width, cloud.height, cloud.point_step, cloud.row_step) == (3, 1, 16, 48)
    assert cloud.header == HEADER
    assert not cloud.is_dense
    for point, start in zip(POINTS[::2], (0, 32), strict=True):
        x, ring = struct.unpack_from('=fH', cloud.data, start)
        (time,) = struct.unpack_from('=d', cloud.data, start + 8)
        assert (x, ring, time) == point


def test_structured_points_round_trip():
    points = np.zeros(4, dtype_from_fields(FIELDS, point_step=24))
    points['ring'] = range(4)
    cloud = create_cloud(HEADER, FIELDS, points, point_step=24)
    assert cloud.point_step == 24
    read = read_points(cloud)
    assert read.dtype == points.dtype
    np.testing.assert_array_equal(read['ring'], points['ring'])
    with pytest.raises(AssertionError, match='do not match'):
        create_cloud(HEADER, FIELDS[:2], points)


def test_reading_gives_a_view(cloud):
    read_points(cloud)['x'][0] = 9.0
    assert struct.unpack_from('=f', cloud.data)[0] == 9.0


def test_selection_of_fields_points_and_nans(cloud):
    assert read_points(cloud, ['ring', 'x']).dtype.names == ('ring', 'x')
    assert read_points(cloud, ['x'], uvs=[2, 0])['x'].tolist() == [3.0, 1.5]
    assert read_points(cloud, skip_nans=True)['ring'].tolist() == [7, 0]
    assert read_points(cloud, ['ring'], skip_nans=True)['ring'].tolist() == [7, 65535, 0]
    assert read_points(cloud, skip_nans=True, uvs=np.array([1]))['ring'].tolist() == [0]
    cloud.is_dense = True
    assert len(read_points(cloud, skip_nans=True)) == 3
    with pytest.raises(AssertionError, match="'intensity'"):
        read_points(cloud, ['x', 'intensity'])


def test_named_tuples(cloud):
    first = read_points_list(cloud)[0]
    assert (first.x, first.ring, first.time) == POINTS[0]
    assert read_points_list(cloud, ['ring'])[1]._fields == ('ring',)


def test_other_byte_order_leaves_the_message_alone():
    swapped = '>f4' if sys.byteorder == 'little' else '<f4'
    data = np.array([1.0, 2.0], swapped).tobytes()
    cloud = PointCloud2(width=2, height=1, point_step=4, fields=FIELDS[:1], data=data)
    cloud.is_bigendian = sys.byteorder == 'little'
    for _ in range(2):
        assert read_points(cloud)['x'].tolist() == [1.0, 2.0]


def test_unstructured_arrays():
    points = np.arange(12.0).reshape(4, 3)
    cloud = create_cloud_xyz32(HEADER, points)
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z']
    assert cloud.point_step == 12
    read = read_points_numpy(cloud)
    assert read.dtype == np.float32
    np.testing.assert_array_equal(read, points)
    np.testing.assert_array_equal(read_points_numpy(cloud, ['z', 'x']), points[:, [2, 0]])


def test_mixed_types_need_structured_points(cloud):
    with pytest.raises(AssertionError, match='same datatype'):
        create_cloud(HEADER, FIELDS, np.zeros((2, 3)))
    with pytest.raises(AssertionError, match='same datatype'):
        read_points_numpy(cloud)


def test_organized_clouds_have_their_width_first():
    points = np.arange(24.0).reshape(2, 4, 3)
    cloud = create_cloud_xyz32(HEADER, points)
    assert (cloud.width, cloud.height) == (2, 4)
    assert read_points(cloud).shape == (8,)
    np.testing.assert_array_equal(read_points_numpy(cloud, reshape_organized_cloud=True), points)
    with pytest.raises(AssertionError, match='not 3'):
        create_cloud_xyz32(HEADER, points[None])


def test_layout_of_fields():
    fields = [
        PointField(name='a', offset=2, datatype=PointField.INT8, count=3),
        PointField(name='', offset=8, datatype=PointField.FLOAT64, count=1),
    ]
    dtype = dtype_from_fields(fields, point_step=20)
    assert dtype.names == ('a_0', 'a_1', 'a_2', 'unnamed_field_1')
    assert [dtype.fields[name][1] for name in dtype.names] == [2, 3, 4, 8]
    assert (dtype.itemsize, dtype_from_fields(fields).itemsize) == (20, 16)
    with pytest.raises(AssertionError, match='Duplicate'):
        dtype_from_fields([FIELDS[0], FIELDS[0]])
    with pytest.raises(AssertionError, match='count = 0'):
        dtype_from_fields([PointField(name='a', datatype=PointField.INT8, count=0)])
