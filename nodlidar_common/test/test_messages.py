import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import (
    nod_from_message,
    nod_to_message,
    time_message,
    transform_message,
)
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand
import pytest

stamps_ns = st.integers(0, 2**31 * 1_000_000_000 - 1)


@given(stamps_ns)
def test_times_come_back(nanoseconds):
    message = time_message(nanoseconds)
    assert 0 <= message.nanosec < 1_000_000_000
    assert time_ns(message) == nanoseconds


def test_a_time():
    message = time_message(1_700_000_000_123_456_789)
    assert (message.sec, message.nanosec) == (1_700_000_000, 123_456_789)


def test_a_transform_is_of_the_child_in_its_parent():
    """A quarter turn to the left."""
    pose = Pose.from_xyzrpy((1.0, 2.0, 3.0, 0.0, 0.0, math.pi / 2))
    message = transform_message(1_700_000_000_123_456_789, 'map', 'odom', pose)
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'odom')
    assert time_ns(message.header.stamp) == 1_700_000_000_123_456_789
    p, q = message.transform.translation, message.transform.rotation
    assert (p.x, p.y, p.z) == (1.0, 2.0, 3.0)
    assert (q.x, q.y, q.z, q.w) == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


@given(
    st.floats(-1.5, 0.0),
    st.floats(0.01, 1.5),
    st.floats(0.01, 100.0),
    st.integers(1, 2**32 - 1),
    stamps_ns,
    stamps_ns,
    stamps_ns,
)
def test_nods_come_back(
    pitch_min, pitch_max, duration, samples, reference_ns, issued_ns, start_ns
):
    nod = Nod(pitch_min, pitch_max, duration, samples, reference_ns)
    message = nod_to_message(nod, issued_ns, 'nodlidar_base_link', start_ns)
    assert nod_from_message(message) == nod
    assert time_ns(message.header.stamp) == issued_ns
    assert time_ns(message.start_time) == start_ns
    assert message.header.frame_id == 'nodlidar_base_link'


def test_a_message_without_a_nod_is_refused():
    with pytest.raises(ParameterError, match="'pitch_max' must be above pitch_min"):
        nod_from_message(NodCommand())
