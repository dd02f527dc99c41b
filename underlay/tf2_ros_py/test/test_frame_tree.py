import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tf2_ros._core import FrameTree
from tf2_ros._links import Link
from tf2_ros._rigid import compose, IDENTITY, interpolate, inverse, Rigid
from tf2_ros.exceptions import (
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)
from transforms3d.quaternions import quat2mat

S = 1_000_000_000
START = 1_700_000_000 * S

units = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
vectors = st.tuples(*[st.floats(-100, 100)] * 3)


@st.composite
def rigids(draw):
    q = draw(units)
    return Rigid(draw(vectors), tuple(i / math.hypot(*q) for i in q))


def matrix(rigid):
    x, y, z, w = rigid.rotation
    result = np.eye(4)
    result[:3, :3] = quat2mat([w, x, y, z])
    result[:3, 3] = rigid.translation
    return result


def yaw(angle, x=0.0):
    return Rigid((x, 0.0, 0.0), (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)))


def tree(*links, span_ns=10 * S):
    """Make a tree of (parent, frame, time or None for static, pose)."""
    result = FrameTree(span_ns)
    for parent, frame, time_ns, pose in links:
        assert result.set(frame, time_ns or 0, Link(parent, pose), is_static=time_ns is None)
    return result


@given(rigids(), rigids())
def test_composition_and_inverse_are_those_of_matrices(a, b):
    np.testing.assert_allclose(matrix(compose(a, b)), matrix(a) @ matrix(b), atol=1e-9)
    np.testing.assert_allclose(matrix(inverse(a)), np.linalg.inv(matrix(a)), atol=1e-9)


@given(rigids(), rigids(), st.floats(0, 1))
def test_interpolation_turns_evenly_the_shorter_way(a, b, ratio):
    def angle(p, q):
        return 2 * math.acos(min(1.0, abs(np.dot(p.rotation, q.rotation))))

    between = interpolate(a, b, ratio)
    assert math.hypot(*between.rotation) == pytest.approx(1.0)
    assert angle(a, between) == pytest.approx(ratio * angle(a, b), abs=1e-6)
    assert angle(between, b) == pytest.approx((1 - ratio) * angle(a, b), abs=1e-6)
    expected = (1 - ratio) * np.array(a.translation) + ratio * np.array(b.translation)
    np.testing.assert_allclose(between.translation, expected, atol=1e-12)


@given(rigids(), rigids(), rigids(), rigids())
def test_lookup_through_a_tree(a, b, c, d):
    frames = tree(
        ('map', 'a', None, a), ('a', 'b', None, b), ('map', 'c', None, c), ('c', 'd', None, d)
    )
    _, pose = frames.lookup('d', 'b', START)
    expected = np.linalg.inv(matrix(c) @ matrix(d)) @ matrix(a) @ matrix(b)
    np.testing.assert_allclose(matrix(pose), expected, atol=1e-9)
    _, back = frames.lookup('b', 'd', START)
    np.testing.assert_allclose(matrix(back), np.linalg.inv(expected), atol=1e-9)


def test_interpolated_lookup_an_epoch_away():
    frames = tree(('odom', 'base', START, yaw(0.0)), ('odom', 'base', START + S, yaw(1.0, x=4.0)))
    time_ns, pose = frames.lookup('odom', 'base', START + S // 4 + 1)
    assert time_ns == START + S // 4 + 1
    assert pose.translation[0] == pytest.approx(1.000000004, abs=1e-12)
    assert 2 * math.atan2(*pose.rotation[2:]) == pytest.approx(0.25, abs=1e-8)


def test_time_zero_is_the_latest_that_all_have_in_common():
    frames = tree(
        ('map', 'odom', None, IDENTITY),
        ('odom', 'base', START, yaw(0.0)),
        ('odom', 'base', START + 2 * S, yaw(0.0, x=2.0)),
        ('base', 'arm', START, IDENTITY),
        ('base', 'arm', START + S, IDENTITY),
    )
    time_ns, pose = frames.lookup('map', 'arm', 0)
    assert time_ns == START + S
    assert pose.translation[0] == 1.0
    assert frames.lookup('map', 'base', 0)[0] == START + 2 * S
    assert frames.lookup('map', 'odom', 0)[0] == 0  # nothing on the way changes over time
    assert frames.lookup('arm', 'arm', 0) == (START + S, IDENTITY)
    assert frames.lookup('nowhere', 'nowhere', 5) == (5, IDENTITY)


def test_static_links_hold_at_all_times_and_stay_when_cleared():
    frames = tree(('base', 'laser', None, yaw(0.0, x=1.0)), ('odom', 'base', START, IDENTITY))
    frames.clear()
    assert frames.lookup('base', 'laser', 1)[1].translation[0] == 1.0
    with pytest.raises(ExtrapolationException, match=r'from frame \[laser\] to frame \[odom\]'):
        frames.lookup('odom', 'laser', START)
    with pytest.raises(TransformException, match='not part of the same'):
        frames.lookup('odom', 'laser', 0)


@pytest.mark.parametrize(
    ('time_ns', 'message'),
    [
        (START + S + 1, r'into the future\.  Requested time 1700000001\.000000 .* 1700000001'),
        (START - S, r'into the past\.  Requested time 1699999999\.000000 .* 1700000000\.000000'),
    ],
)
def test_nothing_is_extrapolated(time_ns, message):
    frames = tree(('odom', 'base', START, IDENTITY), ('odom', 'base', START + S, IDENTITY))
    for target, source in (('odom', 'base'), ('base', 'odom')):
        route = rf'.*from frame \[{source}\] to frame \[{target}\]'
        with pytest.raises(ExtrapolationException, match=message + route):
            frames.lookup(target, source, time_ns)


def test_a_single_link_is_known_at_its_instant():
    frames = tree(('odom', 'base', START, yaw(0.0, x=3.0)))
    assert frames.lookup('odom', 'base', START)[1].translation[0] == 3.0
    with pytest.raises(ExtrapolationException, match=r'at time .*, but only time 1700000000'):
        frames.lookup('odom', 'base', START + 1)


def test_wrong_frames():
    frames = tree(('odom', 'base', None, IDENTITY), ('world', 'moon', None, IDENTITY))
    with pytest.raises(TransformException, match=r"'base' and 'moon' .* not part of the same"):
        frames.lookup('base', 'moon', 0)
    with pytest.raises(TransformException, match=r'"x" passed to .* source_frame does not exist'):
        frames.lookup('base', 'x', 0)


def test_a_loop_is_found():
    frames = tree(
        ('a', 'b', None, IDENTITY), ('b', 'a', None, IDENTITY), ('x', 'y', None, IDENTITY)
    )
    with pytest.raises(TransformException, match='loop: a -> b -> a'):
        frames.lookup('y', 'a', START)


@pytest.mark.parametrize(
    ('parent', 'frame', 'pose', 'message'),
    [
        ('', 'a', IDENTITY, 'frame_id ""'),
        ('a', '/', IDENTITY, 'child_frame_id ""'),
        ('a', '/a', IDENTITY, 'both "a"'),
        ('a', 'b', Rigid((0.0, math.nan, 0.0), IDENTITY.rotation), 'nan'),
        ('a', 'b', Rigid((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)), 'quaternion .* zero'),
    ],
)
def test_invalid_links_are_refused(parent, frame, pose, message):
    with pytest.raises(InvalidArgumentException, match=message):
        FrameTree(S).set(frame, START, Link(parent, pose), is_static=False)


def test_history_of_limited_span_in_any_order():
    frames = FrameTree(10 * S)
    taken = [
        frames.set('base', START + second * S, Link('odom', yaw(0.0, x=float(second))), False)
        for second in (0, 9, 4, 12, 1, 13)
    ]
    assert taken == [True, True, True, True, False, True]  # 1 is over 10 s before 12
    assert frames.lookup('odom', 'base', START + 6 * S)[1].translation[0] == pytest.approx(6.0)
    with pytest.raises(ExtrapolationException, match='earliest data is at time 1700000004'):
        frames.lookup('odom', 'base', START + 3 * S)


def test_new_parent_and_new_kind():
    frames = tree(('left', 'base', START, yaw(0.0, x=1.0)), ('right', 'base', START + S, IDENTITY))
    assert frames.lookup('left', 'base', START + S // 2)[1].translation[0] == 1.0  # not between
    frames.set('base', 0, Link('left', yaw(0.0, x=7.0)), is_static=True)
    assert frames.lookup('left', 'base', 5)[1].translation[0] == 7.0


def test_quaternions_are_normalised():
    frames = tree(('a', 'b', None, Rigid((0.0, 0.0, 0.0), (0.0, 0.0, -5.0, -5.0))))
    half = math.sqrt(0.5)
    assert frames.lookup('a', 'b', 1)[1].rotation == pytest.approx((0.0, 0.0, half, half))
