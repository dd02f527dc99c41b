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
        [joint] = parse(one_joint(kind, content))
        translation, quaternion = joint.pose(position)
        assert joint.turns
        np.testing.assert_allclose(translation, [1, 2, 3])
        np.testing.assert_allclose(
            quat2mat(quaternion), rotation @ turn(axis, position), atol=1e-12
        )


def test_defaults_are_no_offset_and_the_x_axis():
    [joint] = parse(one_joint('continuous'))
    translation, quaternion = joint.pose(1.0)
    assert list(translation) == [0, 0, 0]
    np.testing.assert_allclose(quaternion, [math.cos(0.5), math.sin(0.5), 0, 0])


def test_fixed_joints_stand():
    [joint] = parse(one_joint('fixed', '<origin xyz="1 2 3"/>'))
    assert not joint.turns
    translation, quaternion = joint.pose(0.0)
    assert list(translation) == [1, 2, 3]
    np.testing.assert_allclose(quaternion, [1, 0, 0, 0])


@pytest.mark.parametrize('kind', ['prismatic', 'planar', 'floating'])
def test_other_joints_are_refused_by_name(kind):
    with pytest.raises(UrdfError, match=f"'j' is {kind}, but the underlay covers"):
        parse(one_joint(kind))
    with pytest.raises(UrdfError, match="'j' is a mimic joint"):
        parse(one_joint('revolute', '<mimic joint="lead"/>'))


@pytest.mark.parametrize(
    ('description', 'message'),
    [
        ('', 'robot_description parameter must not be empty'),
        ('garbage', 'is not a URDF: syntax error'),
        ('<robot/>', 'is not a URDF: .*name'),
        (one_joint('hinge'), 'is not a URDF: .*hinge'),
        (robot(''), 'is not a URDF: .*root'),
        (robot(LINKS), 'is not a URDF: .*root'),
        (
            robot(
                f'{LINKS}<joint name="j" type="fixed">{PAIR}</joint>'
                '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'
            ),
            'is not a URDF: .*root',
        ),
    ],
)
def test_what_is_wrong_is_named(description, message):
    with pytest.raises(UrdfError, match=f'(?s){message}'):
        parse(description)


def test_xml_declaration_and_foreign_tags_are_allowed():
    described = robot('<link name="a"/><ros2_control name="x"/><gazebo/>')
    assert parse('<?xml version="1.0" encoding="utf-8"?>' + described) == []
