"""The robot model: xacro parses it; it has the frames and the mount that the assembler uses."""

from math import pi
from pathlib import Path

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_servo.device.config import ServoConfig
from nodlidar_sim.world.scene import load_scene, scene_names
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np
import pytest
from urdf_parser_py.urdf import Cylinder, URDF
import xacro

MODEL = Path(__file__).parents[1] / 'urdf' / 'robot.urdf.xacro'


def model(**arguments):
    return URDF.from_xml_string(xacro.process_file(str(MODEL), mappings=arguments).toxml())


@pytest.mark.parametrize('prefix', ['', 'left_'])
def test_the_frames_form_the_documented_chain(prefix):
    robot = model(prefix=prefix)
    chain = robot.get_chain('base_link', f'{prefix}laser', joints=False, links=True)
    names = ('nodlidar_base_link', 'nodlidar_tilt_link', 'laser')
    assert chain == ['base_link', *(prefix + name for name in names)]


def test_positive_positions_turn_the_beam_up():
    joint = model().joint_map['nod_joint']
    assert joint.axis == [0.0, -1.0, 0.0]


def test_the_limits_are_those_of_the_servo_node_unless_others_are_given():
    limit, servo = model().joint_map['nod_joint'].limit, ServoConfig()
    assert (limit.lower, limit.upper) == (servo.pitch_lower_limit, servo.pitch_upper_limit)
    assert limit.velocity == pytest.approx(servo.dynamics.max_speed, rel=1e-3)
    assert limit.effort == servo.scale.model.max_torque
    given = {'lower': '-0.5', 'upper': '0.4', 'velocity': '3', 'effort': '0.5'}
    limit = model(**given).joint_map['nod_joint'].limit
    assert {name: float(text) for name, text in given.items()} == {
        name: getattr(limit, name) for name in given
    }


LIDARS = pytest.mark.parametrize('lidar', ['', 'LD19'])


@LIDARS
def test_every_part_of_the_sensor_has_a_mass_and_an_inertia_that_a_body_can_have(lidar):
    links = model(lidar=lidar).link_map
    # KDL ignores the inertia of a root, and robot_state_publisher warns of it.
    assert links.pop('base_link').inertial is None
    for name, link in links.items():
        inertia = np.array(link.inertial.inertia.to_matrix())
        moments = np.linalg.eigvalsh(inertia)
        assert link.inertial.mass > 0.0, name
        assert moments[0] > 0.0, name
        assert moments[2] <= moments[0] + moments[1] + 1e-12, name  # of any distribution of mass
    assert links['laser'].inertial.mass == (0.047 if lidar else ServoParameters().load_mass)


@LIDARS
def test_inertias_are_those_of_the_shapes_filled_evenly(lidar):
    rng = np.random.default_rng(1)
    for name in ('nodlidar_base_link', 'nodlidar_tilt_link', 'laser'):
        link = model(lidar=lidar).link_map[name]
        shape, points = link.visual.geometry, rng.uniform(-0.5, 0.5, (200_000, 3))
        if isinstance(shape, Cylinder):
            points = points[np.hypot(points[:, 0], points[:, 1]) < 0.5]
            points = points * (2 * shape.radius, 2 * shape.radius, shape.length)
        else:
            points = points * shape.size
        second = points.T @ points / len(points) * link.inertial.mass
        expected = np.trace(second) * np.eye(3) - second
        np.testing.assert_allclose(
            link.inertial.inertia.to_matrix(), expected, atol=0.02 * expected.max()
        )
        assert link.inertial.origin.xyz == link.visual.origin.xyz


def test_the_laser_is_where_the_assembler_takes_it_to_be():
    origin = model().joint_map['laser_mount'].origin
    assert tuple(origin.xyz) == AssemblerConfig().laser_xyz
    assert tuple(origin.rpy) == AssemblerConfig().laser_rpy
    origin = model(laser_xyz='0.01 0 0.05', laser_rpy='0.2 0 0').joint_map['laser_mount'].origin
    assert tuple(origin.xyz) == (0.01, 0.0, 0.05)
    assert tuple(origin.rpy) == (0.2, 0.0, 0.0)


def test_the_mount_is_where_the_arguments_put_it():
    origin = model(mount_xyz='0.1 0 0.3', mount_rpy=f'0 0 {pi}').joint_map['nodlidar_mount'].origin
    assert tuple(origin.xyz) == (0.1, 0.0, 0.3)
    assert origin.rpy[2] == pytest.approx(pi)


def test_the_sensor_stands_where_the_scenes_put_it():
    origin = model().joint_map['nodlidar_mount'].origin
    for name in scene_names():
        np.testing.assert_allclose(load_scene(name, ideal=True).mount.position, origin.xyz)
