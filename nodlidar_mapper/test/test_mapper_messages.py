"""Messages of the mapper, read as other programs read them."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.origins import frame_of
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import transform_message
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.output.grid import FREE, Grid, OCCUPIED, UNKNOWN
from nodlidar_mapper.ros import messages
from nodlidar_mapper.ros.cloud_input import is_of_odometry
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs_py.point_cloud2 import read_points

STAMP_NS = 1_700_000_000_123_456_789
numbers = st.floats(-100.0, 100.0)


def pose_of(x, y, z, turn):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


poses = st.builds(pose_of, numbers, numbers, numbers, st.tuples(*[st.floats(-3.0, 3.0)] * 3))


@given(pose=poses)
def test_a_pose_comes_back(pose):
    back = messages.matrix_of_pose(messages.pose_message(pose))
    np.testing.assert_allclose(back, pose, atol=1e-9)
    transform = transform_message(STAMP_NS, 'map', 'odom', Pose(pose[:3, 3], pose[:3, :3]))
    np.testing.assert_allclose(messages.matrix_of(transform), pose, atol=1e-9)


@pytest.mark.parametrize('quaternion', [(0.0, 0.0, 0.0, 0.0), (np.nan, 0.0, 0.0, 1.0)])
def test_a_pose_without_orientation_is_refused(quaternion):
    message = messages.pose_message(np.eye(4))
    q = message.orientation
    q.x, q.y, q.z, q.w = quaternion
    with pytest.raises(ValueError, match=r'norm|within'):
        messages.matrix_of_pose(message)


def test_points_in_rows_are_read_and_rows_with_something_between_refused():
    points = np.arange(18.0).reshape(6, 3)
    message = messages.surface_message(Surface(points, points), STAMP_NS, 'base_link')
    message.height, message.width, message.row_step = 2, 3, 3 * message.point_step
    np.testing.assert_array_equal(coordinates(message), points)
    rows = np.frombuffer(message.data, np.uint8).reshape(2, -1)
    message.data = np.pad(rows, ((0, 0), (0, 4))).tobytes()
    message.row_step += 4
    with pytest.raises(ValueError, match='between its rows'):
        coordinates(message)


@pytest.mark.parametrize('x', [1e300, -np.inf, np.nan])
def test_a_pose_nowhere_on_earth_is_refused(x):
    message = messages.pose_message(np.eye(4))
    message.position.x = x
    with pytest.raises(ValueError, match=r'within 1e\+06 m'):
        messages.matrix_of_pose(message)


@pytest.mark.parametrize(
    ('value', 'fits'), [(0.0, True), (1.0, True), (1e308, False), (-1.0, False), (np.nan, False)]
)
def test_a_covariance_is_neither_endless_nor_negative(value, fits):
    assert messages.is_covariance(np.full((6, 6), value)) == fits


def test_a_cell_of_the_grid_is_where_its_message_says():
    cells = np.full((3, 5), UNKNOWN, dtype=np.int8)
    cells[2, 1], cells[0, 4] = OCCUPIED, FREE
    message = messages.grid_message(Grid(cells, (-1.0, 2.0), 0.5), STAMP_NS, 'map')
    info = message.info
    assert (info.width, info.height, info.resolution) == (5, 3, 0.5)
    assert (info.origin.position.x, info.origin.position.y) == (-1.0, 2.0)
    # nav_msgs/OccupancyGrid: row-major, starting at (0, 0); x is along the width.
    assert message.data[2 * 5 + 1] == 100
    assert message.data[4] == 0
    assert set(message.data) == {-1, 0, 100}


@pytest.mark.parametrize(
    ('frame', 'fixed'),
    [
        ('odom', True),
        ('odom_16384_-32768_0', True),
        ('odom_lidar', False),
        ('odom_16384_0', False),
        ('laser', False),
    ],
)
def test_frames_of_odometry_are_known_by_their_names(frame, fixed):
    assert is_of_odometry(frame, 'odom') == fixed


@given(origin=st.tuples(*[st.integers(-(10**8), 10**8)] * 3))
def test_the_frames_of_the_assembler_are_of_odometry(origin):
    assert is_of_odometry(frame_of(origin, 'robot/odom'), 'robot/odom')


def test_points_and_normals_have_the_names_of_pcl():
    surface = Surface(np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 0.0, 1.0]]))
    message = messages.surface_message(surface, STAMP_NS, 'map')
    [point] = read_points(message).tolist()
    assert [field.name for field in message.fields][3:] == ['normal_x', 'normal_y', 'normal_z']
    assert point == (1.0, 2.0, 3.0, 0.0, 0.0, 1.0)
    np.testing.assert_array_equal(coordinates(message), surface.points)


def test_a_cloud_without_coordinates_cut_short_or_with_several_is_refused():
    surface = Surface(np.ones((2, 3)), np.ones((2, 3)))
    message = messages.surface_message(surface, STAMP_NS, 'map')
    message.data = message.data[:20]
    with pytest.raises(ValueError, match='malformed cloud'):
        coordinates(message)
    message = messages.surface_message(surface, STAMP_NS, 'map')
    message.fields = message.fields[1:]
    with pytest.raises(ValueError, match='malformed cloud'):
        coordinates(message)
    message = messages.surface_message(surface, STAMP_NS, 'map')
    message.fields[0].count = 3  # of x
    with pytest.raises(ValueError, match='malformed cloud'):
        coordinates(message)
