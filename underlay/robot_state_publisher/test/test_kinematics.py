import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from robot_state_publisher.kinematics import parse, UrdfError
from transforms3d.quaternions import quat2mat

LINKS = '<link name="a"/><link name="b"/>'
PAIR = '<parent link="a"/><child link="b"/>'
LIMIT = '<limit effort="1" velocity="1" lower="-1" upper="1"/>'


def robot(content):
    return f'<robot name="r">{content}</robot>'


def one_joint(kind, content=''):
    return robot(f'{LINKS}<joint name="j" type="{kind}">{PAIR}{LIMIT}{content}</joint>')


def turn(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def origin_rotation(roll, pitch, yaw):
    return turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)


angles = st.floats(-7, 7)


@given(angles, angles, angles, angles)
def test_poses_follow_the_definition_of_urdf(roll, pitch, yaw, position):
    content = f'<origin xyz="1 2 3" rpy="{roll} {pitch} {yaw}"/><axis xyz="0 -3 4"/>'
    axis = np.array([0, -0.6, 0.8])
    rotation = origin_rotation(roll, pitch, yaw)
    for kind in ('revolute', 'continuous'):
        translation, quaternion = parse(one_joint(kind, content)).moving['j'].pose(position)
        np.testing.assert_allclose(translation, [1, 2, 3])
        np.testing.assert_allclose(
            quat2mat(quaternion), rotation @ turn(axis, position), atol=1e-12
        )
    translation, quaternion = parse(one_joint('prismatic', content)).moving['j'].pose(position)
    np.testing.assert_allclose(translation, [1, 2, 3] + rotation @ axis * position, atol=1e-12)
    np.testing.assert_allclose(quat2mat(quaternion), rotation, atol=1e-12)


def test_defaults_are_no_offset_and_the_x_axis():
    joint = parse(one_joint('continuous')).moving['j']
    translation, quaternion = joint.pose(1.0)
    assert list(translation) == [0, 0, 0]
    np.testing.assert_allclose(quaternion, [math.cos(0.5), math.sin(0.5), 0, 0])


def test_kinds_of_joints():
    kinds = ['fixed', 'floating', 'planar', 'revolute']
    links = '<link name="root"/>' + ''.join(f'<link name="{kind}"/>' for kind in kinds)
    joints = ''.join(
        f'<joint name="to_{kind}" type="{kind}"><parent link="root"/><child link="{kind}"/>'
        f'{LIMIT}</joint>'
        for kind in kinds
    )
    found = parse(robot(links + joints))
    assert sorted(found.fixed) == ['to_fixed', 'to_planar']
    assert sorted(found.moving) == ['to_revolute']


def test_mimics_and_what_is_not_of_the_robot():
    links = ''.join(f'<link name="{name}"/>' for name in 'abcd')
    joints = ''.join(
        f'<joint name="{name}" type="continuous"><parent link="a"/><child link="{child}"/>'
        f'{mimic}</joint>'
        for name, child, mimic in [
            ('lead', 'b', ''),
            ('half', 'c', '<mimic joint="lead" multiplier="0.5" offset="1"/>'),
            ('same', 'd', '<mimic joint="lead"/>'),
        ]
    )
    found = parse(robot(links + joints))

    def positions(names, given_positions):
        return {joint.name: value for joint, value in found.moved(names, given_positions)}

    assert positions(['lead'], [2.0]) == {'lead': 2.0, 'half': 2.0, 'same': 2.0}
    assert positions(['same', 'lead', 'x'], [7.0, 2.0, 1.0]) == {
        'lead': 2.0, 'half': 2.0, 'same': 7.0,
    }  # fmt: skip
    assert positions(['lead', 'lead'], [1.0, 2.0])['lead'] == 1.0
    assert positions(['x'], [1.0]) == {}


@pytest.mark.parametrize(
    ('description', 'message'),
    [
        ('', 'robot_description parameter must not be empty'),
        ('garbage', 'is not a URDF: syntax error'),
        ('<robot/>', 'is not a URDF: .*name'),
        (one_joint('hinge'), 'is not a URDF: .*hinge'),
        (robot(''), 'one root link, but there are none'),
        (robot(LINKS), r"one root link, but there are \['a', 'b'\]"),
        (robot(LINKS + '<link name="a"/>'), "more than one link 'a'"),
        (robot(f'<link name="a"/><joint name="j" type="fixed">{PAIR}</joint>'), "link 'b'"),
        (robot(f'{LINKS}<joint name="j" type="revolute">{PAIR}</joint>'), "'j' .* no limit"),
        (one_joint('continuous', '<axis xyz="0 0 0"/>'), "'j' has an axis of no direction"),
        (
            robot(
                f'{LINKS}<link name="c"/>'
                '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
                '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'
            ),
            r"form a loop: \['a', 'b'\]",
        ),
        (
            robot(
                f'{LINKS}<joint name="j" type="fixed">{PAIR}</joint>'
                f'<joint name="k" type="fixed">{PAIR}</joint>'
            ),
            "more than one child link 'b'",
        ),
    ],
)
def test_what_is_wrong_is_named(description, message):
    with pytest.raises(UrdfError, match=f'(?s){message}'):
        parse(description)


def test_xml_declaration_and_foreign_tags_are_allowed():
    described = robot('<link name="a"/><ros2_control name="x"/><gazebo/>')
    assert parse('<?xml version="1.0" encoding="utf-8"?>' + described).moving == {}
