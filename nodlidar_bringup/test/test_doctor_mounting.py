"""A cloud shows a wrong sign of the joint, a lidar below the axis and a sensor upside down."""

import math
import re
from types import SimpleNamespace

from geometry_msgs.msg import Quaternion, Transform
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_bringup.checks.finding import Level
from nodlidar_bringup.checks.mounting import check_mounting
from nodlidar_bringup.checks.orientation import beams_of, Mounting, points_of, seen_in
from nodlidar_bringup.checks.traffic import Content
from nodlidar_bringup.checks.transforms import Frames
from nodlidar_bringup.commands.doctor import main
from nodlidar_bringup.ros.examination import _of_mount
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2

HEIGHT = 1.0  # of the nod axis in all scenes
NOD = Nod(-0.6136, 0.6136, 7547 * 0.1 / 1024, 7547, 10**18)
LEVER = (0.0, 0.0, 0.08)
NODDING = [-0.6, 0.0, 0.6, 0.0, -0.6, 0.0]  # rad


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


def test_a_wrong_sign_is_found_also_of_a_joint_that_mostly_dwells_at_its_limits(beams):
    """A line of the floor, or of a wall, is no floor: with some zero it is at its height."""
    scene, range_, azimuth, pitch = beams
    if scene == 'corner':  # no floor in view
        return
    times = np.where(np.abs(pitch) > 0.58, 8, 1)
    dwelt = [np.repeat(each, times) for each in (range_, azimuth, pitch)]
    assert checks(found((scene, *dwelt))) == set()
    assert checks(found((scene, *dwelt), sign=-1.0)) == {'joint sign'}


@pytest.mark.parametrize('dwell', [1, 8])
def test_a_small_nod_that_sees_no_floor_is_no_fault(beams, dwell):
    scene, range_, azimuth, pitch = beams
    times = np.where(np.abs(pitch) > 0.25, dwell, 1) * (np.abs(pitch) < 0.3)
    dwelt = [np.repeat(each, times) for each in (range_, azimuth, pitch)]
    assert checks(found((scene, *dwelt))) == set()


def test_a_lidar_below_the_axis_is_found(beams):
    expected = {'walls lean'} if beams[0] == 'corner' else {'lidar upside down'}
    assert checks(found(beams, up=-1.0)) == expected


def test_a_sensor_upside_down_is_found(beams):
    expected = set() if beams[0] == 'corner' else {'sensor upside down'}
    assert checks(found(beams, sign=-1.0, up=-1.0)) == expected


@pytest.mark.parametrize('zero', [-0.35, -0.26, -0.15, -0.1, 0.08, 0.15, 0.26, 0.35])
def test_a_zero_that_is_off_is_named_with_its_size(beams, zero):
    """Small ones move the floor as a lidar below the axis does, so that both are named."""
    scene, range_, azimuth, pitch = beams
    if scene == 'corner':  # no floor in view
        return
    mounting = Mounting(LEVER, HEIGHT)
    [mount, _] = check_mounting(
        seen_in(points_of(range_, azimuth, pitch + zero, LEVER), mounting), mounting
    )
    assert mount.check == ('lidar upside down' if zero == 0.08 else 'pitch off')
    named = re.findall(r'([+-]\d\.\d+) rad', mount.text + mount.remedy)
    assert [float(each) for each in named] == pytest.approx([zero, zero], abs=0.025)


@pytest.mark.parametrize('beams', ['room'], indirect=True)
def test_walls_tell_the_sign_where_the_floor_hardly_does(beams):
    """A nod of 0.5 rad sees little of the floor."""
    scene, range_, azimuth, pitch = beams
    low = np.abs(pitch) < 0.5
    less = scene, range_[low], azimuth[low], pitch[low]
    assert checks(found(less)) == set()
    assert checks(found(less, sign=-1.0)) == {'joint sign'}


@pytest.mark.parametrize('tilt', [-0.3, -0.1, 0.05, 0.2])
def test_a_mount_that_is_known_to_be_tilted_is_level(beams, tilt):
    """It turns the beams down, so that those at this pitch are level."""
    _, range_, azimuth, pitch = beams
    known = Mounting(LEVER, HEIGHT, level=tilt)
    cloud = points_of(range_, azimuth, pitch + tilt, LEVER)
    assert checks(check_mounting(seen_in(cloud, known), known)) == set()
    taken = Mounting((0.0, 0.0, -0.08), HEIGHT, level=tilt)
    cloud = points_of(range_, azimuth, -(pitch + tilt), taken.lever)
    found_checks = checks(check_mounting(seen_in(cloud, taken), taken))
    assert found_checks == {'sensor upside down'} or beams[0] == 'corner'  # no floor in view


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


def watch_with(points, positions, mount=None):
    upright = Transform(rotation=Quaternion(w=1.0))
    return SimpleNamespace(
        transforms={'nodlidar_base_link': mount or upright, 'laser': upright},
        parents={'nodlidar_base_link': {'base_link'}},
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


@pytest.mark.parametrize('phase', np.arange(0.0, 12.0, 1.0))
@pytest.mark.parametrize(('seconds', 'whole'), [(5.0, False), (15.0, True)])
def test_a_part_of_a_slow_sweep_does_not_show_the_mount(phase, seconds, whole):
    """With sweeps of 6 s: floor or ceiling alone would look as with the wrong sign."""
    at = phase + np.arange(0.0, seconds, 0.02)
    positions = np.abs(at / 6.0 % 2.0 - 1.0) * 1.2272 - 0.6136
    mount = Transform(rotation=Quaternion(w=1.0))
    watch = watch_with(lambda frame: np.zeros((0, 3)), positions.tolist(), mount)
    watch.transforms['laser'] = Transform(rotation=Quaternion(w=1.0))
    [finding] = _of_mount(watch, Frames(), '')
    assert finding.level == Level.UNKNOWN
    assert ('no whole sweep' in finding.text) != whole


@pytest.mark.parametrize('seconds', ['nan', 'inf', '0', '-1'])
def test_a_time_to_listen_that_is_none_is_refused(seconds):
    with pytest.raises(ParameterError, match='--seconds'):
        main(['--seconds', seconds])


@pytest.mark.parametrize('roll', [0.0, math.pi])
@pytest.mark.parametrize('pitch', [-0.4, 0.0, 0.15, 0.4])
@pytest.mark.parametrize('error', [0.0, 0.2])
def test_the_tilt_of_the_mount_is_that_of_tf(roll, pitch, error):
    """Floor and wall, as a sensor sees them that is mounted so, or tilted more than it is told."""
    x, y = (
        each.ravel() for each in np.meshgrid(np.linspace(0.8, 3.0, 60), np.linspace(-1, 1, 60))
    )
    floor = np.stack([x, y, np.full_like(x, -1.0)], 1)
    wall = np.stack([np.full_like(x, 3.0), y, x - 1.8], 1)
    mounted = Rotation.from_euler('xyz', [roll, pitch + error, 0.0])
    points = mounted.inv().apply(np.concatenate([floor, wall]))
    told = Rotation.from_euler('xyz', [roll, pitch, 0.0]).as_quat()
    mount = Transform(rotation=Quaternion(**dict(zip('xyzw', told, strict=True))))
    mount.translation.z = 1.0
    watch = watch_with(lambda frame: points, NODDING, mount)
    watch.transforms['laser'] = Transform(rotation=Quaternion(w=1.0))
    watch.transforms['laser'].translation.z = 0.08
    checked = {each.check: each.level for each in _of_mount(watch, Frames(), '')}
    assert ('mount' in checked) == (error == 0.0)
    if not error:
        assert checked['mount'] == Level.GOOD


def test_the_height_of_a_sensor_on_a_mast_is_that_above_the_robot(beams):
    """The mast is turned and tilted, the sensor on it level again."""
    _, *seen = beams
    points = points_of(*seen, LEVER)
    turn = Rotation.from_euler('xyz', [0.0, 0.5, 0.3])
    mast, mount = (
        Transform(rotation=Quaternion(**dict(zip('xyzw', each.as_quat(), strict=True))))
        for each in (turn, turn.inv())
    )
    on_mast = turn.inv().apply([0.1, 0.0, HEIGHT - 0.3])
    mast.translation.z = 0.3
    mount.translation.x, mount.translation.y, mount.translation.z = on_mast.tolist()
    watch = watch_with(lambda frame: points, NODDING, mount)
    watch.transforms |= {'mast': mast, 'laser': Transform(rotation=Quaternion(w=1.0))}
    watch.transforms['laser'].translation.z = LEVER[2]
    watch.parents |= {'nodlidar_base_link': {'mast'}, 'mast': {'base_link'}}
    assert checks(_of_mount(watch, Frames(), '')) == set()
    watch.parents['mast'] = {'odom'}
    [finding] = _of_mount(watch, Frames(), '')
    assert finding.level == Level.UNKNOWN


def test_a_mount_that_is_rolled_is_not_checked():
    rolled = Rotation.from_euler('xyz', [0.1, 0.0, 0.0]).as_quat()
    mount = Transform(rotation=Quaternion(**dict(zip('xyzw', rolled, strict=True))))
    assert (
        _of_mount(watch_with(lambda frame: np.zeros((0, 3)), NODDING, mount), Frames(), '') == []
    )
