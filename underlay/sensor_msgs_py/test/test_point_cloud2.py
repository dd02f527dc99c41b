import struct

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField
from sensor_msgs_py import point_cloud2
from sensor_msgs_py.point_cloud2 import create_cloud, read_points
from std_msgs.msg import Header

FIELDS = [
    PointField(name='x', offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name='ring', offset=4, datatype=PointField.UINT16, count=1),
    PointField(name='y', offset=8, datatype=PointField.FLOAT32, count=1),
]
POINTS = [(1.5, 7, 0.25), (-2.0, 65535, 3.0)]


@pytest.fixture(params=['<', '>'])
def cloud(request):
    """Points 16 bytes apart, in either byte order."""
    data = b''.join(struct.pack(f'{request.param}fH2xf4x', *point) for point in POINTS)
    return PointCloud2(
        width=2,
        height=1,
        point_step=16,
        fields=FIELDS,
        data=data,
        is_bigendian=request.param == '>',
    )


def test_points_are_those_of_the_message(cloud):
    points = read_points(cloud)
    assert points.dtype.names == ('x', 'ring', 'y')
    assert points.tolist() == POINTS
    assert read_points(cloud, ['ring', 'x']).tolist() == [(ring, x) for x, ring, _ in POINTS]


def test_reading_gives_a_view(cloud):
    read_points(cloud)['x'][0] = 9.0
    assert read_points(cloud)['x'][0] == 9.0
    if not cloud.is_bigendian:
        assert struct.unpack_from('<f', cloud.data)[0] == 9.0


@pytest.mark.parametrize('step', [12, 16])
def test_a_created_cloud_is_read_as_it_was(step):
    layout = {
        'names': ['x', 'ring', 'y'],
        'formats': ['f4', 'u2', 'f4'],
        'offsets': [0, 4, 8],
        'itemsize': step,
    }
    points = np.array(POINTS, np.dtype(layout))
    header = Header(frame_id='laser')
    cloud = create_cloud(header, FIELDS, points, None if step == 12 else step)
    assert read_points(cloud).tolist() == POINTS
    assert (cloud.header.frame_id, cloud.height, cloud.width) == ('laser', 1, 2)
    assert (cloud.point_step, cloud.row_step, cloud.is_dense) == (step, 2 * step, False)
    assert create_cloud(header, FIELDS, points[:0], step).width == 0
    with pytest.raises(AssertionError, match='do not match'):
        create_cloud(header, FIELDS, points, 20)


def test_what_is_not_covered_is_named(cloud):
    with pytest.raises(NotImplementedError, match=r'point_cloud2\.read_points_list'):
        _ = point_cloud2.read_points_list
    with pytest.raises(NotImplementedError, match='structured'):
        create_cloud(Header(), FIELDS, [(1.0, 2, 3.0)])
    with pytest.raises(NotImplementedError, match=r'read_points\(skip_nans=\)'):
        read_points(cloud, skip_nans=True)
    cloud.fields[0].count = 3
    with pytest.raises(NotImplementedError, match='several values'):
        read_points(cloud)
