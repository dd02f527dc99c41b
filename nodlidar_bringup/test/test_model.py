"""The robot model: xacro parses it; it has the frames and the mount that the assembler uses."""

from math import pi
from pathlib import Path

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_servo.config import ServoConfig
from nodlidar_sim.world.scene import load_scene, scene_names
import numpy as np
import pytest
from urdf_parser_py.urdf import URDF
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


def test_the_limits_are_those_of_the_servo_node():
    limit = model().joint_map['nod_joint'].limit
    servo = ServoConfig()
    assert (limit.lower, limit.upper) == (servo.pitch_lower_limit, servo.pitch_upper_limit)


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
