"""Points against the transform of docs/model.md, written out per beam."""

import math

from assembling import assemble
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.geometry import (
    Beams,
    REFERENCE_LASER_POSE,
    revolution_time,
    ScanGeometry,
)
from nodlidar_assembler.clouds.point_layout import MOVED_POINT, POINT
from nodlidar_common.pose import Pose
import numpy as np
import pytest
from transforms3d.axangles import axangle2mat
from transforms3d.euler import euler2mat

STEP = 2 * math.pi / 1024
URG = ScanGeometry(682, (44 - 384) * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
URG_AZIMUTH = (np.arange(682) + 44 - 384) * STEP
START_NS = 1_700_000_000_000_000_000


def test_every_beam_ends_where_the_model_says():
    rng = np.random.default_rng(1)
    ranges = rng.uniform(0.1, 5.0, 682).astype(np.float32)
    phi = rng.uniform(-1.0, 1.0, 682)
    points = assemble(Beams(URG, REFERENCE_LASER_POSE), START_NS, ranges, phi).xyz
    for i in range(682):
        theta, r, z_off = (i + 44 - 384) * STEP, float(ranges[i]), 0.080
        expected = (
            r * math.cos(theta) * math.cos(phi[i]) - z_off * math.sin(phi[i]),
            r * math.sin(theta),
            r * math.cos(theta) * math.sin(phi[i]) + z_off * math.cos(phi[i]),
        )
        assert points[i] == pytest.approx(expected, abs=1e-6)


def test_positive_pitch_points_the_forward_beam_up():
    ranges = np.full(682, 2.0, dtype=np.float32)
    beams = Beams(URG, REFERENCE_LASER_POSE)
    points = assemble(beams, START_NS, ranges, np.full(682, 0.5)).xyz
    assert points[384 - 44][2] > 0.5


@given(st.floats(-0.2, 0.2), st.floats(-1.0, 1.0))
def test_beams_may_rise_out_of_the_plane_of_the_lidar(elevation, phi):
    """They lie on a cone about the lidar's axis, which the nod tips back."""
    beams = Beams(URG, REFERENCE_LASER_POSE, elevation)
    ranges = np.full(682, 2.0, dtype=np.float32)
    points = assemble(beams, START_NS, ranges, np.full(682, phi)).xyz
    axis = np.array([-math.sin(phi), 0.0, math.cos(phi)])
    ways = points - 0.080 * axis
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 2.0, atol=1e-6)
    np.testing.assert_allclose(ways @ axis, 2.0 * math.sin(elevation), atol=1e-6)
    np.testing.assert_allclose(
        np.arctan2(ways[:, 1], ways @ [axis[2], 0.0, -axis[0]]), URG_AZIMUTH, atol=1e-6
    )


angle = st.floats(-3.0, 3.0)


@given(
    st.tuples(angle, angle, angle), st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.floats(-1.5, 1.5)
)
def test_any_mount_is_the_chain_of_its_transforms(rpy, offset, phi):
    geometry = ScanGeometry(5, -1.0, 0.5, 1e-4, 0.02, 5.6)
    ranges = np.array([0.5, 1.0, 2.0, 3.0, 4.0], dtype=np.float32)
    points = assemble(
        Beams(geometry, Pose.from_xyzrpy((*offset, *rpy))), START_NS, ranges, np.full(5, phi)
    )
    theta = -1.0 + 0.5 * np.arange(5)
    in_laser = np.stack([np.cos(theta), np.sin(theta), np.zeros(5)]) * ranges
    in_tilt = euler2mat(*rpy, axes='sxyz') @ in_laser + np.reshape(offset, (3, 1))
    expected = axangle2mat((0.0, -1.0, 0.0), phi) @ in_tilt
    np.testing.assert_allclose(points.xyz, expected.T, atol=2e-6)


def test_only_measurements_become_points_and_times_count_from_the_first_of_them():
    ranges = np.full(682, 1.0, dtype=np.float32)
    ranges[:3] = (np.nan, np.inf, -np.inf)
    ranges[100:104] = (0.0, 0.019, 5.7, 1e-40)
    points = assemble(Beams(URG, REFERENCE_LASER_POSE), START_NS, ranges, np.zeros(682))
    kept = np.setdiff1d(np.arange(682), [0, 1, 2, 100, 101, 102, 103])
    assert points.time_ns[0] == START_NS + round(3 * 0.1 / 1024 * 1e9)
    np.testing.assert_allclose(points.data['time'], (kept - 3) * 0.1 / 1024, atol=1e-8)
    assert np.all(np.diff(points.data['time']) > 0)
    assert np.all(np.isfinite(points.xyz))


def test_point_times_keep_microseconds_at_today_s_stamps():
    beams = Beams(URG, REFERENCE_LASER_POSE)
    points = assemble(beams, START_NS, np.ones(682, dtype=np.float32), np.zeros(682))
    exact_ns = np.arange(682) * 100_000_000 / 1024
    np.testing.assert_allclose(points.time_ns - START_NS, exact_ns, atol=0.51)
    np.testing.assert_allclose(points.data['time'] * 1e9, exact_ns, atol=10)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 0.0, 1e6, 1e-3])
def test_a_scan_without_measurements_has_no_points(value):
    ranges = np.full(682, value, dtype=np.float32)
    assert (
        len(assemble(Beams(URG, REFERENCE_LASER_POSE), START_NS, ranges, np.zeros(682)).data) == 0
    )


def test_intensities_are_carried_where_there_are_any():
    beams = Beams(URG, REFERENCE_LASER_POSE)
    ranges = np.ones(682, dtype=np.float32)
    intensities = np.arange(682, dtype=np.float32)
    with_them = assemble(beams, START_NS, ranges, np.zeros(682), intensities)
    without = assemble(beams, START_NS, ranges, np.zeros(682), np.empty(0, np.float32))
    assert np.array_equal(with_them.data['intensity'], intensities)
    assert not np.any(without.data['intensity'])


def test_a_point_is_laid_out_as_documented():
    offsets = {name: POINT.fields[name][1] for name in POINT.names}
    assert offsets == {'x': 0, 'y': 4, 'z': 8, 'intensity': 12, 'time': 16, 'ring': 20}
    assert POINT.itemsize == 24


def test_revolution_is_a_tenth_of_a_second_also_with_clustered_beams():
    clustered = ScanGeometry(227, URG.angle_min, 3 * STEP, 3 * URG.time_increment, 0.02, 5.6)
    assert revolution_time(URG) == pytest.approx(0.1)
    assert revolution_time(clustered) == pytest.approx(0.1)


def moving(beams, position, yaw):
    """Return poses from yaws (n,) at positions that are the same or (n, 3)."""
    half, zero = np.asarray(yaw) / 2, np.zeros(beams)
    orientation = np.stack([zero, zero, np.sin(half), np.cos(half)], axis=1)
    return Poses(np.broadcast_to(np.array(position, float), (beams, 3)), orientation)


def test_every_beam_starts_from_its_own_pose_of_the_base():
    rng = np.random.default_rng(2)
    ranges = rng.uniform(0.1, 5.0, 682).astype(np.float32)
    ranges[5] = np.inf
    phi, yaw = rng.uniform(-1.0, 1.0, 682), rng.uniform(-3.0, 3.0, 682)
    position = rng.uniform(-4.0, 4.0, (682, 3))
    beams = Beams(URG, REFERENCE_LASER_POSE)
    still = assemble(beams, START_NS, ranges, phi)
    moved = assemble(beams, START_NS, ranges, phi, poses=moving(682, position, yaw))
    kept = np.delete(np.arange(682), 5)
    np.testing.assert_array_equal(moved.time_ns, still.time_ns)
    for got, at_pivot, k in zip(moved.xyz, still.xyz, kept, strict=True):
        expected = axangle2mat((0.0, 0.0, 1.0), yaw[k]) @ at_pivot + position[k]
        assert got == pytest.approx(expected, abs=2e-6)


def test_points_that_were_moved_have_no_time_by_which_they_would_be_moved_again():
    poses = moving(682, (0.0, 0.0, 0.0), np.zeros(682))
    intensities = np.arange(682, dtype=np.float32)
    ranges = np.ones(682, dtype=np.float32)
    beams = Beams(URG, REFERENCE_LASER_POSE)
    points = assemble(beams, START_NS, ranges, np.zeros(682), intensities, poses)
    assert points.data.dtype == MOVED_POINT
    assert MOVED_POINT.names == ('x', 'y', 'z', 'intensity', 'ring')
    assert np.array_equal(points.data['intensity'], intensities)


def test_points_that_were_moved_have_the_times_of_the_others_if_so_asked():
    poses = moving(682, (1.0, 2.0, 3.0), np.linspace(0.0, 0.1, 682))
    ranges = np.ones(682, dtype=np.float32)
    ranges[:7] = np.inf
    given = Beams(URG, REFERENCE_LASER_POSE), START_NS, ranges, np.zeros(682)
    bare, timed = assemble(*given, poses=poses), assemble(*given, poses=poses, point=POINT)
    assert timed.data.dtype == POINT
    for name in MOVED_POINT.names:
        np.testing.assert_array_equal(timed.data[name], bare.data[name])
    np.testing.assert_array_equal(timed.data['time'], assemble(*given).data['time'])
