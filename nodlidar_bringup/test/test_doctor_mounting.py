"""A cloud shows a wrong sign of the joint, a lidar below the axis and a sensor upside down."""

from types import SimpleNamespace

from geometry_msgs.msg import Quaternion, Transform
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_bringup.checks.finding import Level
from nodlidar_bringup.checks.mounting import check_mounting
from nodlidar_bringup.checks.orientation import beams_of, Mounting, points_of, seen_in
from nodlidar_bringup.checks.traffic import Content
from nodlidar_bringup.checks.transforms import Frames
from nodlidar_bringup.ros.examination import _of_mount
from nodlidar_common.nod import Nod
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2

HEIGHT = 1.0  # of the nod axis in all scenes
NOD = Nod(-0.6136, 0.6136, 7547 * 0.1 / 1024, 7547, 10**18)
LEVER = (0.0, 0.0, 0.08)
NODDING = [-0.6, 0.0, 0.6]  # rad


@pytest.fixture(scope='module', params=['room', 'corridor', 'building', 'wall', 'corner'])
def beams(request):
    """Return scene, range, azimuth and measured pitch of the beams of 3 s, with real devices."""
    log = simulate(load_scene(request.param, ideal=False), NOD, 3.0, start_ns=10**18)
    since = (log.true_time_ns - 10**18).astype(float)
    pitch = np.interp(since, (log.joint_stamp_ns - 10**18).astype(float), log.joint_position)
    azimuth = np.broadcast_to(log.azimuth, pitch.shape)
    valid = np.isfinite(log.ranges)
    return request.param, log.ranges[valid], azimuth[valid], pitch[valid]


def found(beams, sign=1.0, up=1.0):
    """Return the findings on a cloud that was placed with another sign or lever arm."""
    _, range_, azimuth, pitch = beams
    mounting = Mounting((0.0, 0.0, 0.08 * up), HEIGHT)
    cloud = points_of(range_, azimuth, sign * pitch, mounting.lever)
    return check_mounting(seen_in(cloud, mounting), mounting)


def test_what_is_known_to_be_reversed_is_turned_back():
    """Of a sensor that is upright, but taken to be upside down, and of one above its axis."""
    log = simulate(load_scene('room', ideal=True), NOD, 2.0, start_ns=10**18)
    valid = np.isfinite(log.ranges)
    azimuth = np.broadcast_to(log.azimuth, valid.shape)[valid]
    beams = log.ranges[valid], azimuth, log.true_pitch[valid]
    taken = Mounting(LEVER, HEIGHT, upside_down=True)
    [mount, _] = check_mounting(seen_in(points_of(*beams, LEVER), taken), taken)
    assert 'mount_rpy:="0 0 0"' in mount.remedy
    below = Mounting((0.0, 0.0, -0.08), HEIGHT)
    [mount, _] = check_mounting(seen_in(points_of(*beams, below.lever), below), below)
    assert 'is above the axis, not below' in mount.text
    assert 'laser_xyz:="0 0 0.08"' in mount.remedy


def checks(findings):
    return {finding.check for finding in findings if finding.level >= Level.WARNING}


def test_the_right_mount_is_not_a_fault(beams):
    assert checks(found(beams)) == set()


def test_a_wrong_sign_of_the_joint_is_found(beams):
    expected = {'walls lean'} if beams[0] == 'corner' else {'joint sign'}  # no floor in view
    assert checks(found(beams, sign=-1.0)) == expected


def test_a_lidar_below_the_axis_is_found(beams):
    expected = {'walls lean'} if beams[0] == 'corner' else {'lidar upside down'}
    assert checks(found(beams, up=-1.0)) == expected


def test_a_sensor_upside_down_is_found(beams):
    expected = set() if beams[0] == 'corner' else {'sensor upside down'}
    assert checks(found(beams, sign=-1.0, up=-1.0)) == expected


def test_the_nearest_thing_is_on_its_side():
    """A pole to the left of a wall, which is also the nearest thing."""
    azimuth = np.tile(np.linspace(-1.0, 1.0, 400), 10)
    range_ = np.where(np.abs(azimuth - 0.5) < 0.02, 1.5, 2.0 / np.cos(azimuth))
    cloud = points_of(range_, azimuth, np.linspace(-0.1, 0.1, 4000), LEVER)
    for mounting, side in (
        (Mounting(LEVER, HEIGHT), 'left'),
        (Mounting(LEVER, HEIGHT, upside_down=True), 'right'),  # left of a sensor that hangs
    ):
        findings = check_mounting(seen_in(cloud, mounting), mounting)
        text = {finding.check: finding.text for finding in findings}['left and right']
        assert '1.50 m away' in text
        assert f'to the {side}' in text


def test_few_points_show_nothing():
    [finding] = check_mounting(
        seen_in(np.ones((10, 3)), Mounting(LEVER, HEIGHT)), Mounting(LEVER, HEIGHT)
    )
    assert finding.level == Level.UNKNOWN


@given(
    st.floats(0.5, 30.0),
    st.floats(-1.2, 1.2),
    st.floats(-0.8, 0.8),
    st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
)
def test_points_turn_back_into_their_beams(range_, azimuth, pitch, lever):
    beam = np.array([range_]), np.array([azimuth]), np.array([pitch])
    back = beams_of(points_of(*beam, lever), lever)
    np.testing.assert_allclose(np.concatenate(back), [range_, azimuth, pitch], atol=1e-6)


def watch_with(points, positions):
    upright = Transform(rotation=Quaternion(w=1.0))
    return SimpleNamespace(
        transforms={'nodlidar_base_link': upright, 'laser': upright},
        points=points,
        content=lambda joint: Content(joint_name=joint, positions=positions),
    )


def test_a_malformed_cloud_is_a_finding():
    """It has no x; without the handling, all other findings would be lost."""
    cloud = PointCloud2(height=1, width=1, data=[0])
    [finding] = _of_mount(watch_with(lambda frame: coordinates(cloud), NODDING), Frames(), '')
    assert finding.level == Level.FAULT
    assert 'malformed cloud' in finding.text


def test_the_plane_of_a_joint_that_stands_still_does_not_show_the_mount():
    """Turned up, a single plane meets walls in lines that lean."""
    azimuth = np.linspace(-0.7, 0.7, 2000)
    pitch = np.full(2000, 0.619)
    wall = 2.0 / (np.cos(pitch) * np.cos(azimuth))  # 2 m ahead, upright
    points = points_of(wall, azimuth, pitch, LEVER)
    still = [0.6190, 0.6191]
    assert _of_mount(watch_with(lambda frame: points, still), Frames(), '') == []
    assert _of_mount(watch_with(lambda frame: points, NODDING), Frames(), '') != []
