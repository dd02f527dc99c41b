"""The demo's picture and PLY file: what is seen where, and what other programs read."""

from nodlidar_assembler.bags.write_clouds import open_output
from nodlidar_assembler.clouds.point_layout import POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_demo.pictures import picture, seen_from, write_picture
import numpy as np
from plyfile import PlyData
import pytest


@pytest.fixture
def points():
    """Two clouds' points, 50 ms apart, each with times of its own as the assembler gives them."""
    data = np.zeros(400, dtype=POINT)
    rng = np.random.default_rng(0)
    for axis in 'xyz':
        data[axis] = rng.uniform(-1.0, 1.0, 400)
    data['time'] = np.tile(np.arange(200) * 1e-4, 2)
    times = data['time'].astype(np.float64) + np.repeat([0.0, 0.05], 200)
    return Points(1_700_000_000_000_000_000 + np.rint(times * 1e9).astype(np.int64), data)


def test_a_camera_sees_its_target_in_the_middle_and_up_upwards():
    eye, target = np.array([-2.0, 0.0, 1.0]), np.array([2.0, 0.0, 1.0])
    xyz = target + np.array([[0, 0, 0], [0, 0, 1], [0, 1, 0], [4, 0, 2]])
    expected = [[0, 0, 4], [0, 0.25, 4], [-0.25, 0, 4], [0, 0.25, 8]]
    np.testing.assert_allclose(seen_from(xyz, eye, target), expected, atol=1e-15)


def test_an_oblique_camera_keeps_angles():
    rng = np.random.default_rng(1)
    eye, target = np.array([-1.3, -0.7, 0.9]), np.array([2.0, 0.0, -0.1])
    xyz = eye + (target - eye) + rng.uniform(-0.5, 0.5, (50, 3))
    across, up, depth = seen_from(xyz, eye, target).T
    ray = xyz - eye
    ahead = (target - eye) / np.linalg.norm(target - eye)
    np.testing.assert_allclose(depth, ray @ ahead)
    tangent = np.linalg.norm(np.cross(ray, ahead), axis=1) / (ray @ ahead)
    np.testing.assert_allclose(np.hypot(across, up), tangent)


def test_a_ply_file_has_the_points_and_one_time_for_all(points, tmp_path):
    with open_output(tmp_path / 'cloud.ply', AssemblerConfig()) as file:
        file.write(points, 'nodlidar_base_link', 0)
    # The type names of PLY 1.0, as ushort, are not read by Open3D and meshio.
    assert b'property uint16 ring' in (tmp_path / 'cloud.ply').read_bytes()
    vertex = PlyData.read(tmp_path / 'cloud.ply')['vertex']
    assert {p.name: p.val_dtype for p in vertex.properties} == {
        'x': 'f4',
        'y': 'f4',
        'z': 'f4',
        'intensity': 'f4',
        'time': 'f8',
        'ring': 'u2',
    }
    for axis in 'xyz':
        np.testing.assert_array_equal(vertex[axis], points.data[axis])
    assert vertex['time'][0] == 0.0
    assert vertex['time'][200] == pytest.approx(0.05, abs=1e-9)
    assert (np.diff(vertex['time']) > 0).all()


def test_a_picture_is_written_without_a_display(points, tmp_path):
    write_picture(points.xyz, tmp_path / 'cloud.png', 'a title')
    assert (tmp_path / 'cloud.png').read_bytes().startswith(b'\x89PNG')
    with pytest.raises(FileNotFoundError, match=r"'.*no/cloud.png'"):
        write_picture(points.xyz, tmp_path / 'no' / 'cloud.png', 'a title')


def test_a_picture_has_three_views_coloured_by_height(points):
    figure = picture(points.xyz, 'a title')
    perspective, above, right = (axes.collections[0] for axes in figure.axes[:3])
    z = points.data['z']
    assert np.isin(perspective.get_array(), z.astype(np.float64)).all()
    # The ends of the line of sight are left out: from above the heights, from the right y.
    assert np.ptp(above.get_array()) < 0.92 * np.ptp(z)
    assert np.ptp(right.get_array()) > 0.97 * np.ptp(z)
    x_and_z = np.stack([points.data['x'], z], axis=1).astype(np.float64)
    drawn = np.asarray(right.get_offsets())
    assert 300 < len(drawn) < 400
    assert (drawn[:, None] == x_and_z).all(axis=2).any(axis=1).all()
    # Painted from far to near.
    assert (np.diff(above.get_array()) >= 0).all()
