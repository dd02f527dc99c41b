"""The checks of the launch arguments, without a launch."""

from contextlib import nullcontext
from dataclasses import fields, replace
import math
from pathlib import Path
import re

from nodlidar_assembler.calibration.calibration import Calibration
from nodlidar_assembler.calibration.recorded import start_values
from nodlidar_assembler.commands.calibrate import write
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig
from nodlidar_bringup.argument_values import (
    calibrated,
    check,
    check_assembler,
    check_mapping,
    check_parameter_file,
    expand,
    joint_limits,
    numbers,
    remarks,
    robot_description,
    sensor_height,
    servo_config,
    servo_limits,
)
from nodlidar_bringup.ros.launch_arguments import ARGUMENTS
from nodlidar_common.dynamics import check_nod
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.parameters import limits_of, misspelt
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS, shortest_by_mean_speed
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.models.models import MODELS
from nodlidar_sim.devices.servo_models import EMULATED
import numpy as np
import pytest

FASTEST = 1023 * 0.111  # rpm that the register of an RX-24F can hold
RPM = math.tau / 60.0  # rad/s
OF_MAPPING = ('mapper_params', 'map', 'save', 'bag')  # of mapping.launch.py alone
XACRO = Path(__file__).parents[1] / 'urdf' / 'robot.urdf.xacro'
PLACES = {
    'mount_xyz': '0 0 1.0',
    'mount_rpy': '0 0 0',
    'laser_xyz': '0 0 0.080',
    'laser_rpy': '0 0 0',
}


@pytest.fixture
def values(tmp_path):
    """Return arguments that are as they must be."""
    path = tmp_path / 'params.yaml'
    path.write_text('/**:\n  ros__parameters: {}\n')
    nodes = 'driver', 'servo', 'assembler', 'viewer'
    files = {f'{node}_params': str(path) for node in nodes}
    files['calibration'] = ''
    scene = {
        'hardware': 'sim',
        'scene': 'room',
        'route': '',
        'seed': '0',
        'lidar': '',
        'servo': '',
    }
    tf = {'frame_prefix': '', 'own_tf': 'false', 'tf_rate': ''}
    return {'namespace': '', **tf, **PLACES, **files, **scene}


@pytest.mark.parametrize(
    'change',
    [
        {},
        {'namespace': '/left/front_2/', 'frame_prefix': 'left_'},
        {'frame_prefix': 'robot-1/left.'},
        {'namespace': 'robot1', 'own_tf': 'true'},
        {'tf_rate': '1e3'},
        {'mount_xyz': ' -1e-3\t+.5 7 ', 'route': 'turn', 'scene': 'wall'},
        {'hardware': 'real', 'scene': 'moon'},
        {'servo': 'XL430-W250', 'seed': '7'},
        {'lidar': 'UST-10LX'},
        {'lidar': 'rplidar'},
        {'hardware': 'real', 'servo': 'XL330-M288'},
        {'hardware': 'real', 'servo': 'none'},
        {'hardware': 'real', 'lidar': 'rplidar'},
        {'hardware': 'real', 'servo': 'trajectory'},
        {'servo': 'trajectory'},
    ],
)
def test_good_arguments_pass(values, change):
    check(values | change)


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('laser_xyz', '0 0', "'laser_xyz' must be three numbers [m], separated by spaces"),
        ('laser_xyz', 'a b c', "but is 'a b c'"),
        ('mount_rpy', '0 0 nan', "'mount_rpy' must be three numbers [rad]"),
        ('mount_xyz', '0 0 inf', "'mount_xyz' must be three numbers [m]"),
        ('mount_xyz', '0 0 1e300', 'each between -100.0 and 100.0 m'),
        ('mount_rpy', '0 30 0', 'each between -6.2832 and 6.2832 rad'),  # degrees
        ('laser_xyz', '0 0 80', 'each between -10.0 and 10.0 m'),  # millimetres
        ('mount_xyz', '0 0 100', 'the optical centre between -100.0 and 100.0 m above the floor'),
        ('mount_xyz', '0 0 1" foo', "'mount_xyz' must be three numbers [m]"),
        ('tf_rate', 'often', "'tf_rate' must be from 1 to 1000 Hz, but is 'often'"),
        ('tf_rate', '0', "'tf_rate' must be from 1 to 1000 Hz"),
        ('tf_rate', 'nan', "'tf_rate' must be from 1 to 1000 Hz"),
        ('frame_prefix', 'a b', "'frame_prefix' must be letters, digits"),
        ('own_tf', 'true', "'own_tf' must be false without a namespace"),
        ('frame_prefix', '/left', "'frame_prefix' must be letters, digits"),
        ('frame_prefix', '"><link/>', "'frame_prefix' must be letters, digits"),
        ('namespace', '2nd', "'namespace' must be letters, digits"),
        ('namespace', 'a//b', "'namespace' must be letters, digits"),
        ('driver_params', 'none.yaml', "'driver_params' must be a YAML file of parameters"),
        ('servo_params', '', "'servo_params' must be a YAML file of parameters"),
        (
            'scene',
            'moon',
            "'scene' must be one of building, corner, corridor, crossing, room, wall, or a",
        ),
        (
            'lidar',
            'none',
            "'lidar' must be one of URG-04LX-UG01, UST-10LX, UST-20LX, UTM-30LX, LD19, rplidar, "
            "ldlidar, ydlidar, urg_node2 in sim, but is 'none'",
        ),
        ('servo', 'none', "'servo' must be one of RX-24F, RX-28, RX-64, AX-12A, AX-18A, MX-28"),
        ('servo', 'none', "XL330-M288, XL330-M077, STS3215, trajectory in sim, but is 'none'"),
        ('seed', '-1', "'seed' must be a whole number from 0, but is '-1'"),
        ('seed', 'any', "'seed' must be a whole number from 0"),
        ('route', 'home', "'route' must be one of approach, figure_of_eight, turn, or a"),
    ],
)
def test_a_wrong_argument_is_named_with_what_is_allowed(values, name, value, words):
    with pytest.raises(NodlidarError) as caught:
        check(values | {name: value})
    assert words in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('lidar', ['LD19', 'URG-04LX-UG01'])
def test_the_parameters_of_an_ld19_are_those_of_its_driver(values, tmp_path, lidar):
    path = tmp_path / 'driver.yaml'
    path.write_text('/**:\n  ros__parameters: {least_confidence: 300}\n')
    found = values | {'lidar': lidar, 'driver_params': str(path)}
    if lidar == 'LD19':
        with pytest.raises(NodlidarError, match="'least_confidence' must be between 0 and 255"):
            check(found)
    else:
        check(found)  # has no such parameter, like all nodes of the file but one


@pytest.mark.parametrize('content', ['[1, 2', '- a', 'text', '\x80', ''])
def test_a_file_that_holds_no_parameters_is_named(values, tmp_path, content):
    path = tmp_path / 'wrong.yaml'
    path.write_bytes(content.encode('latin-1'))
    with pytest.raises(NodlidarError, match="'servo_params' must be a YAML file") as caught:
        check(values | {'servo_params': str(path)})
    assert str(path) in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('node', 'text', 'words'),
    [
        ('driver', 'skip: -1', "'skip' must be between 0 and"),
        (
            'assembler',
            'deadline: 99.0',
            "'deadline' must be between 0.001 and 10.0 s, but is 99.0",
        ),
        ('assembler', 'deadline: .nan', "'deadline' must be finite"),
        ('assembler', "cloud_mode: 'tilt'", "'cloud_mode' must be one of"),
        ('assembler', 'deadline: 1', "'deadline' must be of type float, but is 1"),
        ('viewer', 'port: -1', "'port' must be"),
        ('mapper', 'map_period: 0.0', "'map_period' must be"),
    ],
)
@pytest.mark.parametrize(
    ('section', 'namespace'), [('/**', ''), ('{}', ''), ('/left/{}', 'left'), ('/**/{}', 'left')]
)
def test_a_value_out_of_range_is_named_with_its_file_before_any_node_starts(
    tmp_path, node, text, words, section, namespace
):
    path = tmp_path / 'wrong.yaml'
    section = section.format(node)
    path.write_text(
        f'other: {{ros__parameters: {{skip: x}}}}\n{section}: {{ros__parameters: {{{text}}}}}\n'
    )
    with pytest.raises(NodlidarError) as caught:
        check_parameter_file(f'{node}_params', str(path), namespace)
    assert str(caught.value).startswith(f"'{path}': {words}")


@pytest.mark.parametrize(
    ('texts', 'own', 'words'),
    [
        (['{pitch_min: 0.7}'], {}, "'pitch_max' must be at least .* rad above pitch_min = 0.7"),
        (['{pitch_min: 0.7}', '{pitch_max: 0.8}'], {}, None),
        (
            ['{profile: slam}', '{without_odometry: uncompensated}'],
            {},
            "'without_odometry' must be drop with clouds per sweep",
        ),
        (['{without_odometry: uncompensated}'], {}, None),
        (['{odom_frame: a}'], {'frame_id': 'a', 'ego_motion': 'beam'}, "'odom_frame' must be"),
        (['{odom_frame: a}'], {'frame_id': 'a'}, None),
        (['{profile: quick}'], {}, "'profile' must be one of fast, balanced, slam"),
    ],
)
def test_parameters_of_the_assembler_that_contradict_each_other_are_named(
    tmp_path, texts, own, words
):
    paths = [tmp_path / f'{k}.yaml' for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(f'/**: {{ros__parameters: {text}}}\n')
    derived, own = {'mount_tilt': [0.0, 0.0]}, {'laser_xyz': [0.0, 0.0, 0.1], **own}
    with pytest.raises(NodlidarError, match=words) if words else nullcontext():
        check_assembler([*map(str, paths)], '', derived, own)


@pytest.mark.parametrize('ego_motion', ['', 'deskew'])
def test_the_mapper_takes_deskewed_sweeps(ego_motion):
    check_mapping({'map': '', 'save': '', 'profile': 'slam', 'ego_motion': ego_motion})


def test_a_folder_in_which_no_map_can_be_saved_is_refused(tmp_path):
    (tmp_path / 'file').touch()
    values = {'map': '', 'save': str(tmp_path / 'file'), 'profile': 'slam', 'ego_motion': ''}
    with pytest.raises(ParameterError, match="'save' must be a folder for maps"):
        check_mapping(values)
    check_mapping({**values, 'save': str(tmp_path / 'maps')})


DEFAULTS = {name: str(each['default_value']) for name, each in ARGUMENTS.items()}


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({}, []),
        ({'map': 'a', 'mapper_params': 'b', 'use_sim_time': 'true', 'ros_namespace': 'c'}, []),
        ({'hardware': 'real', 'lidar_port': '/dev/ttyACM1'}, []),
        ({'servo_port': '/dev/ttyUSB1'}, ["'servo_port' has no effect with hardware:=sim"]),
        (
            {'hardware': 'real', 'ideal': 'true', 'seed': '7', 'lidar': 'UTM-30LX'},
            [f"'{name}' has no effect with hardware:=real" for name in ('ideal', 'seed', 'lidar')],
        ),
        ({'hardware': 'real', 'lidar': 'LD19'}, []),
        ({'lidarport': 'x'}, ["there is no argument 'lidarport': is 'lidar_port' meant?"]),
    ],
)
def test_what_has_no_effect_is_told(given, words):
    assert remarks(DEFAULTS | given, DEFAULTS) == words


def test_a_path_may_begin_with_the_home_directory(monkeypatch):
    monkeypatch.setenv('HOME', '/home/someone')
    given = {'assembler_params': '~/a.yaml', 'map': '~/office', 'scene': 'room', 'namespace': '~'}
    expand(given)
    assert given == {
        'assembler_params': '/home/someone/a.yaml',
        'map': '/home/someone/office',
        'scene': 'room',
        'namespace': '~',
    }


def test_no_argument_of_a_launch_file_is_taken_for_another():
    assert misspelt([*ARGUMENTS, *OF_MAPPING], ARGUMENTS) == []


@pytest.mark.parametrize(
    ('section', 'namespace', 'told'),
    [
        ('/**', '', None),
        ('/left/servo', '/left/', None),
        ('servo_node', '', '/servo'),
        ('servo', 'left', '/left/servo'),
        ('/right/servo', 'left', '/left/servo'),
    ],
)
def test_a_file_without_a_section_for_its_node_is_told(tmp_path, capsys, section, namespace, told):
    path = tmp_path / 'own.yaml'
    path.write_text(f'{section}: {{ros__parameters: {{invert: true}}}}')
    check_parameter_file('servo_params', str(path), namespace)
    remark = f"'{path}' sets nothing: it has no section '/**' or '{told}'\n"
    assert capsys.readouterr().err == (remark if told else '')


SHARED = {
    each.name: limits_of(each)
    for each in (*fields(AssemblerConfig), *fields(ProfileConfig))
    if each.name in ARGUMENTS
}


def refused_by_launch(values, name, value):
    """Return what the launch says of an argument; empty if it accepts it."""
    try:
        check(values | {name: value})
    except NodlidarError as error:
        return str(error)
    return ''


def test_what_launch_and_assembler_call_alike_is_known():
    assert set(SHARED) == {'laser_xyz', 'laser_rpy', 'ego_motion', 'adapt_limits', 'profile'}


@pytest.mark.parametrize('name', ['laser_xyz', 'laser_rpy'])
@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize('outward', [-1, 1])
def test_the_launch_accepts_a_number_if_and_only_if_the_assembler_does(
    values, name, axis, outward
):
    edge = SHARED[name].minimum if outward < 0 else SHARED[name].maximum

    def at(number):
        return ' '.join(str(number if k == axis else 0.0) for k in range(3))

    check(values | {name: at(edge)})
    check_assembler([], '', {}, {name: numbers(name, at(edge))})
    for beyond in (math.nextafter(edge, outward * math.inf), outward * 999.0):
        said = refused_by_launch(values, name, at(beyond))
        assert said.startswith(f"'{name}' must be")  # what was given, not what follows from it
        with pytest.raises(NodlidarError, match=f"'{name}' must be"):
            check_assembler([], '', {}, {name: [float(word) for word in at(beyond).split()]})


@pytest.mark.parametrize('name', [name for name, limits in SHARED.items() if limits.choices])
def test_the_choices_of_the_launch_are_choices_of_the_assembler(name):
    assert set(ARGUMENTS[name]['choices']) - {''} <= set(SHARED[name].choices)


def test_the_servos_of_the_launch_are_models_of_its_node():
    servos = set(ARGUMENTS['servo']['choices']) - {'', 'trajectory', 'none'}
    assert servos == set(limits_of(ServoConfig.__dataclass_fields__['model']).choices)


@pytest.mark.parametrize('height', [-100.0, 100.0])
def test_a_mount_at_its_limits_is_accepted_by_the_assembler(values, height):
    given = values | {'mount_xyz': f'-100 100 {height}', 'laser_xyz': '0 0 0'}
    check(given)
    check_assembler([], '', {'sensor_height': sensor_height(given)}, {})


def test_numbers_are_taken_as_they_are():
    assert numbers('laser_xyz', '0.01 0 -5e-2') == [0.01, 0.0, -0.05]


@pytest.mark.parametrize(
    ('name', 'value'), [('laser_xyz', [0.0, 0.0, 80.0]), ('laser_rpy', [180.0, 0.0, 0.0])]
)
def test_millimetres_and_degrees_of_the_lidar_are_refused(name, value):
    with pytest.raises(NodlidarError, match=f"'{name}' must be between -"):
        check_assembler([], '', {}, {name: value})


def test_a_robot_model_is_made_or_what_is_wrong_with_it_is_told(tmp_path):
    assert 'xyz="0 0 0.080"' in robot_description(str(XACRO), PLACES | {'prefix': 'left_'})
    path = tmp_path / 'broken.urdf.xacro'
    path.write_text('<robot')
    with pytest.raises(NodlidarError, match=f"xacro cannot process '{path}'"):
        robot_description(str(path), {})


def test_a_calibration_sets_the_place_of_the_lidar(values, tmp_path):
    path, config = tmp_path / 'calibration.yaml', AssemblerConfig()
    start = start_values(config)
    found = replace(start, x=0.005, z=0.085, roll=0.01, yaw=0.02, delay=0.008, elevation=0.003)
    write(path, Calibration(start, found, {}, {}, 0.03, 0.02, 5), config)
    changed = calibrated(values | {'calibration': str(path)})
    assert numbers('laser_xyz', changed['laser_xyz']) == [0.005, 0.0, 0.085]
    assert numbers('laser_rpy', changed['laser_rpy']) == [0.01, 0.0, 0.02]
    assert changed.keys() == values.keys()
    check(changed)
    assert calibrated(values) == values


def test_a_missing_calibration_is_named(values):
    with pytest.raises(NodlidarError, match="'calibration' must be a YAML file"):
        calibrated(values | {'calibration': '/nowhere.yaml'})


@pytest.mark.parametrize(
    ('servo', 'text', 'speed', 'acceleration'),
    [
        ('', '{}', 6.0, 150.0),
        ('RX-24F', '{model: AX-12A}', 6.0, 150.0),
        ('', '{model: AX-12A, acceleration: 40.0}', MAX_SPEEDS['AX-12A'], 30.0),
        ('XL430-W250', '{}', MAX_SPEEDS['XL430-W250'], 150.0),
        ('trajectory', '{}', 6.0 * 6.0 / (FASTEST * math.tau / 60.0), 37.5),
        ('trajectory', '{max_speed: 0.01, acceleration: 1.0}', 0.01, 1.0),
    ],
)
def test_the_nod_is_planned_for_the_servo(tmp_path, servo, text, speed, acceleration):
    path = tmp_path / 'servo.yaml'
    path.write_text(f'servo: {{ros__parameters: {text}}}\n')
    limits = servo_limits(servo_config(servo, [str(path)], ''))
    assert limits == pytest.approx({'max_nod_speed': speed, 'max_nod_acceleration': acceleration})


@pytest.mark.parametrize(
    ('given', 'height'),
    [
        ({}, 1.08),
        ({'mount_xyz': '0 0 0.3'}, 0.38),
        ({'mount_xyz': '0.2 0 0.3', 'laser_xyz': '0.02 0 -0.05'}, 0.25),
        ({'mount_xyz': '0 0 0.3', 'mount_rpy': '3.14159265 0 0'}, 0.22),  # hangs from above
        ({'mount_rpy': '0 1.57079633 0', 'laser_xyz': '0.1 0 0.08'}, 0.9),  # looks down
    ],
)
def test_the_assembler_knows_how_high_the_lidar_is(values, given, height):
    assert sensor_height({**values, **given}) == pytest.approx(height)


def test_a_nod_is_planned_for_every_model_and_none_is_faster_than_its_servo():
    assert list(MAX_SPEEDS) == list(EMULATED) == list(MODELS)
    assert all(speed < 0.75 * MODELS[name].fastest for name, speed in MAX_SPEEDS.items())


def test_the_table_of_the_servos_says_what_the_code_says():
    page = (Path(__file__).parents[2] / 'nodlidar_servo' / 'README.md').read_text()
    rows = [line.split('|')[1:-1] for line in page.splitlines() if line.startswith('|')]
    cells = {row[0].strip(): [cell.strip() for cell in row] for row in rows}
    for name, model in MODELS.items():
        _, _, speed, torque, nod, _ = cells[name]
        assert float(speed) == pytest.approx(model.max_speed, abs=0.051), name
        assert (float(torque), float(nod)) == (model.max_torque, MAX_SPEEDS[name])


def test_the_table_of_the_arguments_has_each_with_its_default():
    page = (Path(__file__).parents[1] / 'README.md').read_text()
    documented = {}
    for row in re.findall(r'^\| (`.*?) \| (.*?)\|', page.split('## How it runs')[0], re.MULTILINE):
        names, defaults = (re.findall('`(.*?)`', cell) for cell in row)
        documented.update(zip(names, defaults or [''] * len(names), strict=True))
    expected = {name: '' if name.endswith('_params') else DEFAULTS[name] for name in ARGUMENTS}
    assert documented == {**expected, **dict.fromkeys(OF_MAPPING, '')}


@pytest.mark.parametrize('model', [*MODELS, 'trajectory'])
def test_a_servo_accepts_every_nod_that_is_planned_for_it(values, model):
    config = TrajectoryConfig() if model == 'trajectory' else ServoConfig(model=model)
    limits = servo_limits(servo_config(model, [values['servo_params']], ''))
    for span in np.geomspace(0.05, 1.6, 100):
        sweep = shortest_by_mean_speed(float(span), *limits.values())
        check_nod(Nod(-span / 2, span / 2, sweep, 1, 0), -0.8, 0.8, config.dynamics)


@pytest.mark.parametrize(
    ('namespace', 'model', 'limit'), [('left', 'XL330-M288', 0.2), ('right', 'RX-24F', 0.6)]
)
def test_one_file_serves_two_robots_and_a_third_has_the_defaults(
    tmp_path, namespace, model, limit
):
    path = tmp_path / 'two.yaml'
    text = '{{ros__parameters: {{model: {}, pitch_upper_limit: {}}}}}\n'
    left, right = text.format('XL330-M288', 0.2), text.format('RX-24F', 0.6)
    path.write_text(f'/left/servo: {left}/right/servo: {right}servo: {left}')
    found = servo_config('', [str(path)], namespace)
    assert (found.model, found.pitch_upper_limit) == (model, limit)
    assert servo_config('', [str(path)], 'middle') == ServoConfig()


def test_a_section_for_all_nodes_in_the_profile_comes_before_those_of_the_file(tmp_path):
    profile, path = tmp_path / 'profile.yaml', tmp_path / 'servo.yaml'
    profile.write_text('/**: {ros__parameters: {}}')
    text = '{}: {{ros__parameters: {{pitch_upper_limit: {}}}}}\n'
    path.write_text(text.format('servo', 0.2) + text.format('/**', 0.6))
    assert servo_config('', [str(path)], '').pitch_upper_limit == 0.6
    assert servo_config('', [str(profile), str(path)], '').pitch_upper_limit == 0.2


def test_what_is_wrong_with_the_servo_s_parameters_is_named(tmp_path):
    path = tmp_path / 'servo.yaml'
    path.write_text('servo: {ros__parameters: {model: RX-99}}\n')
    with pytest.raises(NodlidarError, match="'model' must be one of"):
        servo_config('', [str(path)], '')
    assert servo_limits(servo_config('none', [str(path)], '')) == {}


@pytest.mark.parametrize(
    ('servo', 'text', 'expected'),
    [
        ('', '{}', {'lower': -0.8, 'upper': 0.8, 'velocity': FASTEST * RPM, 'effort': 2.6}),
        (
            'XL330-M288',
            '{pitch_upper_limit: 0.5}',
            {'lower': -0.8, 'upper': 0.5, 'velocity': 103 * RPM, 'effort': 0.52},
        ),
        ('trajectory', '{max_speed: 3.0}', {'lower': -0.8, 'upper': 0.8, 'velocity': 3.0}),
        ('none', '{}', {}),
    ],
)
def test_the_joint_of_the_robot_model_has_the_limits_of_the_servo(tmp_path, servo, text, expected):
    path = tmp_path / 'servo.yaml'
    path.write_text(f'servo: {{ros__parameters: {text}}}\n')
    limits = joint_limits(servo_config(servo, [str(path)], ''))
    assert {name: float(limit) for name, limit in limits.items()} == pytest.approx(
        expected, rel=1e-3
    )
