"""Poses between odometry samples, against closed forms and transforms3d."""

import math

from hypothesis import assume, given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, OdometryError, Poses
from nodlidar_common.pose import Pose
import numpy as np
import pytest
from transforms3d.axangles import axangle2mat
from transforms3d.euler import euler2mat
from transforms3d.quaternions import axangle2quat, qmult, quat2mat

S = 1_000_000_000
START_NS = 1_700_000_000 * S
ANY = OdometryConfig(math.inf, math.inf, math.inf)

units = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
units = units.map(lambda q: np.array(q) / math.hypot(*q))
positions = st.tuples(*[st.floats(-1e3, 1e3)] * 3).map(np.array)
axes = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: math.hypot(*a) > 0.1)
shares = st.floats(0, 1)
signs = st.sampled_from([-1.0, 1.0])


def xyzw(wxyz):
    return np.roll(wxyz, -1)


def wxyz(q):
    return np.roll(q, 1)


def odometry(seconds, position, orientation):
    time_ns = START_NS + np.rint(np.array(seconds, dtype=float) * S).astype(np.int64)
    return Odometry(time_ns, Poses(np.array(position, float), np.array(orientation, float)))


def yaws(seconds, angles, xs=None):
    """Return odometry that turns about z, and moves along x."""
    half = np.array(angles) / 2
    zero = np.zeros_like(half)
    xs = zero if xs is None else np.array(xs)
    orientation = np.stack([zero, zero, np.sin(half), np.cos(half)], axis=1)
    return odometry(seconds, np.stack([xs, zero, zero], axis=1), orientation)


def instants(*seconds):
    return START_NS + np.rint(np.array(seconds) * S).astype(np.int64)


@given(units, axes, st.floats(0.0, math.pi - 1e-3), shares, signs, positions, positions)
def test_between_two_samples_it_turns_evenly_and_moves_straight_on(
    q, axis, angle, share, sign, p0, p1
):
    turned = xyzw(qmult(wxyz(q), axangle2quat(axis, angle)))
    samples = odometry([0, 1], [p0, p1], [q, sign * turned])
    at = instants(share)
    share = (at[0] - START_NS) / S
    poses = samples.at(at, ANY)
    expected = quat2mat(wxyz(q)) @ axangle2mat(axis, share * angle)
    np.testing.assert_allclose(quat2mat(wxyz(poses.orientation[0])), expected, atol=1e-9)
    assert np.linalg.norm(poses.orientation[0]) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(poses.position[0], (1 - share) * p0 + share * p1, atol=1e-9)


@given(st.lists(st.tuples(units, positions, signs), min_size=2, max_size=8), st.data())
def test_at_the_samples_it_is_the_samples_whatever_their_signs(samples, data):
    gaps = data.draw(st.lists(st.floats(1e-3, 10), min_size=len(samples), max_size=len(samples)))
    seconds = np.cumsum(gaps)
    q, p, sign = map(np.array, zip(*samples, strict=True))
    found = odometry(seconds, p, sign[:, None] * q).at(instants(*seconds), ANY)
    np.testing.assert_allclose(found.position, p, atol=1e-9)
    for got, given_q in zip(found.orientation, q, strict=True):
        np.testing.assert_allclose(quat2mat(wxyz(got)), quat2mat(wxyz(given_q)), atol=1e-9)


@given(st.lists(units, min_size=3, max_size=6), st.lists(signs, min_size=6, max_size=6), shares)
def test_the_sign_of_a_quaternion_means_nothing(qs, sign, share):
    qs = np.array(qs)
    dots = np.abs(np.sum(qs[1:] * qs[:-1], axis=1))
    assume(np.all(dots > 1e-3))  # at half a turn either way is as short
    seconds = np.arange(len(qs))
    zeros = np.zeros((len(qs), 3))
    flipped = np.array(sign[: len(qs)])[:, None] * qs
    at = instants(share * (len(qs) - 1))
    one = odometry(seconds, zeros, qs).at(at, ANY).orientation[0]
    two = odometry(seconds, zeros, flipped).at(at, ANY).orientation[0]
    np.testing.assert_allclose(quat2mat(wxyz(one)), quat2mat(wxyz(two)), atol=1e-9)


@given(units, positions, positions)
def test_points_go_to_the_parent_as_by_matrices(q, p, point):
    [found] = Poses(p[None], q[None]).to_parent(point[None])
    np.testing.assert_allclose(found, quat2mat(wxyz(q)) @ point + p, atol=1e-9)


@given(units, positions, st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-1, 1)] * 3))
def test_a_mounted_frame_is_the_chain_of_its_transforms(q, p, rpy, xyz):
    samples = odometry([0, 1], [p, p], [q, q]).mounted(Pose.from_xyzrpy((*xyz, *rpy)))
    rotation = quat2mat(wxyz(q))
    np.testing.assert_allclose(samples.poses.position[1], rotation @ xyz + p, atol=1e-9)
    got = quat2mat(wxyz(samples.poses.orientation[1]))
    np.testing.assert_allclose(got, rotation @ euler2mat(*rpy, axes='sxyz'), atol=1e-9)


def test_many_beams_over_many_samples_each_between_its_own_neighbours():
    seconds = np.array([0.0, 0.02, 0.04, 0.07, 0.08])
    angles, xs = np.array([0.0, 0.01, 0.05, 0.02, 0.03]), np.array([0.0, 0.1, 0.15, 0.1, 0.4])
    beams = np.linspace(0.001, 0.08, 682)
    poses = yaws(seconds, angles, xs).at(instants(*beams), ANY)
    np.testing.assert_allclose(poses.position[:, 0], np.interp(beams, seconds, xs), atol=1e-8)
    yaw = 2 * np.arctan2(poses.orientation[:, 2], poses.orientation[:, 3])
    np.testing.assert_allclose(yaw, np.interp(beams, seconds, angles), atol=1e-8)


@pytest.mark.parametrize(
    ('q', 'message'),
    [
        ((0.0, 0.0, 0.0, 0.0), 'length is not 1 within 0.005: 0.0'),
        ((0.0, 0.0, 0.0, 5e-324), 'length is not 1'),
        ((0.0, 0.0, 0.0, 0.9949), 'length is not 1'),
        ((0.0, 0.0, 0.0, 1.0051), 'length is not 1 within 0.005: 1.0051'),
        ((0.0, 0.0, 0.0, 1e300), 'length is not 1'),
        ((math.nan, 0.0, 0.0, 1.0), 'not finite'),
        ((math.inf, 0.0, 0.0, 1.0), 'not finite'),
    ],
)
def test_what_is_no_rotation_is_refused(q, message):
    with pytest.raises(OdometryError, match=message):
        odometry([0, 1], np.zeros((2, 3)), [(0.0, 0.0, 0.0, 1.0), q])


@pytest.mark.parametrize('seconds', [[0, 1, 1], [0, 2, 1], [2, 1, 0]])
def test_stamps_that_do_not_ascend_are_refused(seconds):
    with pytest.raises(OdometryError, match='do not ascend'):
        yaws(seconds, [0.0, 0.0, 0.0])


def test_parts_of_unequal_lengths_are_refused():
    with pytest.raises(OdometryError, match='unequal'):
        odometry([0, 1, 2], np.zeros((2, 3)), np.eye(4)[[3, 3, 3]])


@given(st.floats(-5, 10))
def test_outside_of_the_samples_there_is_no_pose(second):
    samples = yaws([0, 1, 2], [0.0, 0.1, 0.2])
    if instants(0)[0] <= instants(second)[0] <= instants(2)[0]:
        assert len(samples.at(instants(second), ANY).position) == 1
    else:
        where = 'before the first' if second < 0 else 'after the last'
        with pytest.raises(OdometryError, match=f'no odometry {where} beam'):
            samples.at(np.sort(instants(1, second)), ANY)


@pytest.mark.parametrize('count', [0, 1])
def test_fewer_than_two_samples_are_not_enough(count):
    samples = yaws(np.zeros(count), np.zeros(count))
    with pytest.raises(OdometryError, match='fewer than two'):
        samples.at(instants(0), ANY)


@pytest.mark.parametrize(
    ('limits', 'reason'),
    [
        (OdometryConfig(0.09, 9.0, 9.0), 'odometry more than 0.09 s apart'),
        (OdometryConfig(0.2, 0.9, 9.0), 'odometry jumps: it moves faster than 0.9 m/s'),
        (OdometryConfig(0.2, 9.0, 0.4), 'odometry jumps: it turns faster than 0.4 rad/s'),
    ],
)
def test_a_gap_or_a_jump_counts_only_where_it_is_used(limits, reason):
    # From 0.2 to 0.3 s it moves by 1 m/s and turns by 0.5 rad/s.
    samples = yaws([0.12, 0.2, 0.3, 0.38], [0.0, 0.0, 0.05, 0.05], [0.0, 0.0, 0.1, 0.1])
    samples.at(instants(0.13, 0.2 - 1e-6), limits)
    samples.at(instants(0.3, 0.37), limits)
    with pytest.raises(OdometryError, match=reason) as caught:
        samples.at(instants(0.19, 0.21), limits)
    assert caught.value.reason == reason
    assert str(caught.value).startswith(reason + ': ')


def test_no_beams_have_no_poses():
    assert len(yaws([0, 1], [0.0, 0.0]).at(instants(), ANY).position) == 0
