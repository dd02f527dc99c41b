"""Positions of the joint and pitches of the scan plane, and the nod in either."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.dynamics import check_nod, Dynamics
from nodlidar_common.nod import Nod
import numpy as np
import pytest

NS = 10**9
BEGIN_NS = 1_700_000_000 * NS


def axis(way, zero):
    return AssemblerConfig(joint_positive=way, joint_zero=zero).joint_axis


@pytest.mark.parametrize(
    ('way', 'position', 'pitch'), [('up', 0.5, 0.2), ('down', 0.5, -0.2), ('down', 0.1, 0.2)]
)
def test_a_position_is_a_pitch_with_the_zero_and_the_direction(way, position, pitch):
    assert axis(way, 0.3).pitch(position) == pytest.approx(pitch)
    assert axis(way, 0.3).position(pitch) == pytest.approx(position)


def test_limits_of_the_position_are_limits_of_the_pitch():
    assert axis('up', 0.0).pitches(-0.5, 0.8) == (-0.5, 0.8)
    assert axis('up', 0.1).pitches(-0.5, 0.8) == pytest.approx((-0.6, 0.7), abs=2e-6)
    assert axis('down', 0.1).pitches(-0.5, 0.8) == pytest.approx((-0.7, 0.6), abs=2e-6)


@given(
    way=st.sampled_from(['up', 'down']),
    zero=st.floats(-1.0, 1.0),
    low=st.floats(-1.5, -0.1),
    high=st.floats(0.1, 1.5),
)
def test_a_nod_up_to_the_limits_of_the_mount_is_within_them(way, zero, low, high):
    joint = axis(way, zero)
    nod = joint.positions(Nod(*joint.pitches(low, high), 1.0, 4001, BEGIN_NS))
    check_nod(nod, low, high, Dynamics(1e3, 1e-3, 100.0))


@given(
    way=st.sampled_from(['up', 'down']),
    zero=st.floats(-1.0, 1.0),
    low=st.floats(-1.0, 0.0),
    span=st.floats(0.1, 1.0),
    duration=st.floats(0.05, 20.0),
    elapsed=st.lists(st.integers(-100 * NS, 100 * NS), min_size=1, max_size=20),
)
def test_the_scan_plane_nods_as_wanted_if_the_joint_follows(
    way, zero, low, span, duration, elapsed
):
    wanted = Nod(low, low + span, duration, 4001, BEGIN_NS)
    joint = axis(way, zero)
    times_ns = BEGIN_NS + np.array(elapsed)
    found = [joint.pitch(float(each)) for each in joint.positions(wanted).pitch(times_ns)]
    # The reference time is a whole number of nanoseconds.
    np.testing.assert_allclose(found, wanted.pitch(times_ns), atol=1e-9 + 2e-9 * wanted.speed)
