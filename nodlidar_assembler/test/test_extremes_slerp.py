"""SLERP and quaternions at their limits, against closed forms (docs/extremes.md)."""

from fractions import Fraction
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, OdometryError, Poses
from nodlidar_assembler.clouds.pitch import beam_pitch
import numpy as np
import pytest

S = 1_000_000_000
ANGLES = (0.0, 1e-12, math.pi - 1e-12, math.pi)
ANY = OdometryConfig(math.inf, math.inf, math.inf)

units = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
units = units.map(lambda q: np.array(q) / math.hypot(*q))
axes = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: math.hypot(*a) > 0.1)
axes = axes.map(lambda a: np.array(a) / math.hypot(*a))
shares = st.integers(0, 64).map(lambda k: k / 64)  # whole nanoseconds of a second, exact in binary


def product(a, b):
    """Return the Hamilton product of quaternions x, y, z, w."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def turn(axis, angle):
    return np.array([*(math.sin(angle / 2) * axis), math.cos(angle / 2)])


def apart(a, b):
    """Return how far two quaternions are apart as rotations: q and -q are the same."""
    return min(np.max(np.abs(a - b)), np.max(np.abs(a + b)))


def between(first, second, share, start_ns=0):
    """Return the orientation at a share of the way, by odometry one second apart."""
    odometry = Odometry(
        start_ns + np.array([0, S]), Poses(np.zeros((2, 3)), np.array([first, second]))
    )
    (found,) = odometry.at(start_ns + np.array([round(share * S)]), ANY).orientation
    return found


@pytest.mark.parametrize('angle', ANGLES)
@given(units, axes, shares, st.sampled_from([1.0, -1.0]))
def test_it_turns_evenly_the_shorter_way_also_between_q_and_minus_q(angle, q, axis, share, sign):
    found = between(q, sign * product(q, turn(axis, angle)), share)
    ways = [angle, -angle] if angle == math.pi else [angle]  # half a turn is as far either way
    expected = [product(q, turn(axis, share * way)) for way in ways]
    assert min(apart(found, candidate) for candidate in expected) < 2e-15
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-15)


@given(axes, shares)
def test_a_turn_of_a_picoradian_is_divided_too(axis, share):
    found = between(turn(axis, 0.0), turn(axis, 1e-12), share)
    np.testing.assert_allclose(found[:3], share * 0.5e-12 * axis, rtol=1e-9, atol=1e-25)


@pytest.mark.parametrize('start_ns', [0, S - 1, 1_700_000_000 * S, 2**31 * S - S // 2])
def test_stamps_make_no_difference_to_it(start_ns):
    axis = np.array([0.0, 0.6, 0.8])
    found = between(turn(axis, 0.0), turn(axis, 1.0), 0.25, start_ns)
    assert apart(found, turn(axis, 0.25)) < 1e-15


@pytest.mark.parametrize('angle', [math.pi - 1e-12, math.pi])
def test_half_a_turn_from_one_sample_to_the_next_is_a_jump_unless_limits_allow_it(angle):
    axis = np.array([0.0, 0.0, 1.0])
    poses = Poses(np.zeros((2, 3)), np.array([turn(axis, 0.0), turn(axis, angle)]))
    odometry = Odometry(np.array([0, S // 10]), poses)
    with pytest.raises(OdometryError, match=r'jumps: it turns faster than 10\.0 rad/s: 31\.42'):
        odometry.at(np.array([1000]), OdometryConfig())


@given(units, axes, st.sampled_from([0.9951, 1.0, 1.0049]), st.sampled_from([0.9951, 1.0, 1.0049]))
def test_quaternions_that_are_longer_or_shorter_by_half_a_percent_are_scaled(q, axis, one, two):
    other = product(q, turn(axis, 1.0))
    found = between(one * q, two * other, 0.25)
    assert apart(found, product(q, turn(axis, 0.25))) < 2e-15


@pytest.mark.parametrize('angle', ANGLES)
@pytest.mark.parametrize('first', [-math.pi / 2, 0.0, 1e-12, 0.6136])
def test_between_joint_samples_the_nod_turns_evenly(angle, first):
    second = first + angle
    offset = np.arange(65) / 64
    samples = np.array([0, S]), np.array([first, second])
    found = beam_pitch('slerp', 0, offset, *samples, max_gap=1.0)
    way = Fraction(second) - Fraction(first)
    expected = [float(Fraction(first) + Fraction(k, 64) * way) for k in range(65)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-16)
