"""Checks of the launch arguments, before any node is started."""

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import fields, replace
import os
from pathlib import Path
import re
import sys
from typing import Any

from nodlidar_assembler.clouds.geometry import LaserPoseConfig
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.ldrobot import LD19
from nodlidar_common.parameter_file import file_values, read_parameters, sections
from nodlidar_common.parameters import check as check_parameters
from nodlidar_common.parameters import check_ranges, limits_of, misspelt
from nodlidar_common.pose import Pose
from nodlidar_common.yaml_file import YamlError
from nodlidar_driver.config import LdrobotConfig, ScipConfig
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_sim.devices.make_devices import LIDARS, SERVOS
from nodlidar_sim.devices.scip_models import SCIP_MODELS
from nodlidar_sim.world.scene import load_scene
from nodlidar_viewer.config import ViewerConfig
import xacro

ONLY_WITH = {
    'real': ('lidar_port', 'servo_port'),
    'sim': ('scene', 'route', 'ideal', 'seed', 'base'),
}
PATHS = ('scene', 'route', 'description', 'calibration', 'map', 'bag')
_NAMESPACE = re.compile(r'/?([A-Za-z_]\w*(/[A-Za-z_]\w*)*/?)?', re.ASCII)
_FASTEST = 1000.0  # [Hz], of robot_state_publisher, which counts in milliseconds
# Moves the transforms into the namespace of a node, as nav2 does for several robots.
OWN_TF = ('--ros-args', '-r', '/tf:=tf', '-r', '/tf_static:=tf_static')
# The files of servo and driver are each for one of two nodes: see servo_config and check. That of
# the mapper is imported late: see _configuration.
_CONFIGURATIONS: dict[str, type[Any]] = {
    'driver': ScipConfig,
    'assembler': AssemblerConfig,
    'viewer': ViewerConfig,
}
_LIMITS = {each.name: limits_of(each) for each in fields(AssemblerConfig)}
# The limits of each number of an argument are those of the parameter that it becomes or is like.
_PLACES = {
    'mount_xyz': _LIMITS['sensor_height'],
    'mount_rpy': _LIMITS['laser_rpy'],
    'laser_xyz': _LIMITS['laser_xyz'],
    'laser_rpy': _LIMITS['laser_rpy'],
}
_FRAME_PREFIX = re.compile(r'([A-Za-z0-9_][A-Za-z0-9_./-]*)?')


def check(values: Mapping[str, str]) -> None:
    """Check the arguments without a list of choices; raises ParameterError."""
    check_namespace(values['namespace'])
    check_frame_prefix(values['frame_prefix'])
    if values['own_tf'] == 'true' and not values['namespace'].strip('/'):
        raise ParameterError('own_tf', 'false without a namespace', values['own_tf'])
    for name in _PLACES:
        numbers(name, values[name])
    sensor_height(values)
    if values['tf_rate']:
        tf_rate(values['tf_rate'])
    for name in ('driver_params', 'servo_params', 'assembler_params', 'viewer_params'):
        config = LdrobotConfig if (name, values['lidar']) == ('driver_params', LD19) else None
        check_parameter_file(name, values[name], values['namespace'], config)
    if values['hardware'] == 'sim':
        for name, models in (('lidar', LIDARS), ('servo', SERVOS)):
            if values[name] and values[name] not in models:
                raise ParameterError(name, f'one of {", ".join(models)} in sim', values[name])
        if not re.fullmatch('[0-9]{1,18}', values['seed']):
            raise ParameterError('seed', 'a whole number from 0', values['seed'])
        load_scene(values['scene'], values['route'] or None)


def remarks(given: Mapping[str, str], known: Mapping[str, str]) -> list[str]:
    """Return what is given without effect: misspelt names, and what other devices have.

    Parameters
    ----------
    given
        All arguments of the launch, also those of the files that include it.
    known
        Default values of the declared arguments.
    """
    hardware = given['hardware']
    without_effect = [
        name
        for needed, names in ONLY_WITH.items()
        for name in names
        if needed != hardware and given[name] != known[name]
    ]
    if hardware == 'real' and given['lidar'] in SCIP_MODELS:
        without_effect.append('lidar')
    return [
        *misspelt(given, known, 'argument'),
        *(f"'{name}' has no effect with hardware:={hardware}" for name in without_effect),
    ]


def expand(values: MutableMapping[str, str]) -> None:
    """Replace ~ by the home directory at the beginning of all paths, which bash leaves after :=.

    The arguments of all launch files of the package are known here.
    """
    for name in values:
        if name in PATHS or name.endswith('_params'):
            values[name] = os.path.expanduser(values[name])


def check_mapping(values: Mapping[str, str]) -> None:
    """Raise ParameterError for a wrong folder of a map, or clouds that are no deskewed sweeps."""
    from nodlidar_mapper.output.map_folder import make_parent  # see _configuration
    from nodlidar_mapper.output.saved_map import KEYFRAMES

    folder = values['map']
    if folder and not os.path.isfile(os.path.join(folder, KEYFRAMES)):
        raise ParameterError('map', f"the folder of a saved map, with '{KEYFRAMES}'", folder)
    try:
        if values['save']:
            make_parent(Path(values['save']))
    except (NodlidarError, OSError) as error:
        limit = f'a folder for maps ({in_words(error)})'
        raise ParameterError('save', limit, values['save']) from error
    if values['profile'] != 'slam':
        raise ParameterError('profile', 'slam with the mapper', values['profile'])
    if values['ego_motion'] not in ('', 'deskew'):
        raise ParameterError('ego_motion', 'deskew or empty with the mapper', values['ego_motion'])


def numbers(name: str, text: str) -> list[float]:
    """Return the three numbers of an argument such as '0 0 0.08'; raises ParameterError."""
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    limits = _PLACES[name]
    if len(values) != 3 or not all(map(limits.allow, values)):
        allowed = f'three numbers [{limits.unit}], separated by spaces, each {limits.in_words()}'
        raise ParameterError(name, allowed, text)
    return values


def sensor_height(values: Mapping[str, str]) -> float:
    """Return the height of the optical centre over base_link, which is on the floor [m].

    Raises
    ------
    ParameterError
        If the assembler does not allow it.
    """
    mount, laser = (
        Pose.from_xyzrpy([*numbers(xyz, values[xyz]), *numbers(rpy, values[rpy])])
        for xyz, rpy in (('mount_xyz', 'mount_rpy'), ('laser_xyz', 'laser_rpy'))
    )
    height, limits = float((mount @ laser).position[2]), _LIMITS['sensor_height']
    if not limits.allow(height):
        allowed = f'a place with the optical centre {limits.in_words()} above the floor'
        raise ParameterError('mount_xyz', allowed, values['mount_xyz'])
    return height


def tf_rate(text: str) -> float:
    """Return the highest rate of the transform of the nod [Hz]; raises ParameterError."""
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not 1.0 <= rate <= _FASTEST:
        raise ParameterError('tf_rate', f'from 1 to {_FASTEST:g} Hz', text)
    return rate


def calibrated(values: Mapping[str, str]) -> dict[str, str]:
    """Return the arguments with the place of the lidar of the calibration, if there is one.

    Raises
    ------
    ParameterError
        If its file cannot be read, or a value is not allowed.
    """
    if not values['calibration']:
        return dict(values)
    file, namespace = values['calibration'], values['namespace']
    check_parameter_file('calibration', file, namespace)
    found = file_values([file], full_name(namespace, 'assembler'), LaserPoseConfig)
    check_parameters(replace(LaserPoseConfig(), **found))
    places = found.keys() & _PLACES  # the other values are no arguments: the assembler reads them
    return {**values, **{name: ' '.join(map(str, found[name])) for name in places}}


def servo_config(
    servo: str, files: Sequence[str], namespace: str
) -> ServoConfig | TrajectoryConfig | None:
    """Return the parameters of the servo's node; None if there is no such node.

    Parameters
    ----------
    servo
        The launch argument.
    files
        The parameter files of the servo's node, in its order.
    namespace
        Its namespace.

    Raises
    ------
    ParameterError
        If a value in the files is not allowed.
    """
    if servo == 'none':
        return None
    node: Any = TrajectoryConfig if servo == 'trajectory' else ServoConfig
    model = {'model': servo} if servo and node is ServoConfig else {}
    values = file_values(files, full_name(namespace, 'servo'), node)
    config: ServoConfig | TrajectoryConfig = node(**{**values, **model})
    check_parameters(config)
    return config


def servo_limits(config: ServoConfig | TrajectoryConfig | None) -> dict[str, float]:
    """Return the parameters of the assembler that follow from what the servo can do.

    The speed is that of the model; a joint of ros2_control, and any acceleration, have the same
    share of what they can do as an RX-24F.
    """
    if config is None:
        return {}
    can, assumed, reference = config.dynamics, NodConfig(), ServoConfig().dynamics
    if isinstance(config, ServoConfig):
        speed = MAX_SPEEDS[config.model]
    else:
        speed = assumed.max_nod_speed * can.max_speed / reference.max_speed
    acceleration = assumed.max_nod_acceleration * can.acceleration / reference.acceleration
    found = {'max_nod_speed': speed, 'max_nod_acceleration': acceleration}
    limits: dict[str, Any] = {each.name: limits_of(each) for each in fields(NodConfig)}
    return {
        name: min(max(value, limits[name].minimum), limits[name].maximum)
        for name, value in found.items()
    }


def joint_limits(config: ServoConfig | TrajectoryConfig | None) -> dict[str, str]:
    """Return the limits of the joint for the robot model; what is missing, the model has."""
    if config is None:
        return {}
    limits = {
        'lower': config.pitch_lower_limit,
        'upper': config.pitch_upper_limit,
        'velocity': config.dynamics.max_speed,
    }
    if isinstance(config, ServoConfig):
        limits['effort'] = config.scale.model.max_torque
    return {name: str(limit) for name, limit in limits.items()}


def joined_namespace(outer: str, own: str) -> str:
    """Return a namespace within another one, as launch_ros does: an absolute one replaces it."""
    outer = outer.rstrip('/')
    return own if own.startswith('/') or not outer else f'{outer}/{own}'.rstrip('/')


def full_name(namespace: str, name: str) -> str:
    """Return the full name of a node or topic in a namespace."""
    return f'/{namespace.strip("/")}/{name}'.replace('//', '/')


def check_namespace(text: str) -> None:
    """Raise ParameterError if ROS does not allow the namespace."""
    if not _NAMESPACE.fullmatch(text):
        allowed = "letters, digits, '_' and '/', no part of it beginning with a digit"
        raise ParameterError('namespace', allowed, text)


def check_frame_prefix(text: str) -> None:
    """Raise ParameterError if tf2 or URDF does not allow frames with this prefix."""
    if not _FRAME_PREFIX.fullmatch(text):
        allowed = "letters, digits and any of '_./-', the first one a letter, a digit or '_'"
        raise ParameterError('frame_prefix', allowed, text)


def check_parameter_file(
    name: str, path: str, namespace: str, config_class: type[Any] | None = None
) -> None:
    """Raise ParameterError if a parameter file is missing or malformed, or a value out of range.

    ROS itself would start the node with its defaults if the file is missing, and the node would
    find a value that is out of range only when the others have started.

    Parameters
    ----------
    name, path
        The launch argument, and the file.
    namespace
        The namespace of the node.
    config_class
        The class of its parameters; by default that of the argument.
    """
    try:
        file = read_parameters(path)
    except YamlError as error:
        raise ParameterError(name, f'a YAML file of parameters ({error})', path) from error
    node = name.removesuffix('_params')
    full = full_name(namespace, node)
    if node != name and not sections(full, file):
        print(f"'{path}' sets nothing: it has no section '/**' or '{full}'", file=sys.stderr)
    config_class = config_class or _configuration(node)
    if config_class is None:
        return
    try:
        values = file_values([path], full, config_class)
        check_ranges(config_class, values)
        if node != 'assembler':  # see check_assembler
            check_parameters(config_class(**values))
    except YamlError:
        raise
    except ParameterError as error:
        raise YamlError(path, str(error)) from error


def _configuration(node: str) -> type[Any] | None:
    """Return the class of the parameters of a node; None for those of others."""
    if node != 'mapper':
        return _CONFIGURATIONS.get(node)
    # Imported here: with SciPy, the mapper takes a third of the start of a launch.
    from nodlidar_mapper.config import MapperConfig

    return MapperConfig


def check_assembler(
    files: Sequence[str], namespace: str, derived: Mapping[str, Any], own: Mapping[str, Any]
) -> None:
    """Raise ParameterError if the parameters of the assembler contradict each other.

    Parameters
    ----------
    files
        Its parameter files, in its order.
    namespace
        Its namespace.
    derived, own
        Parameters that the files override, and those that override the files.
    """
    node = full_name(namespace, 'assembler')
    profile = ProfileConfig(**file_values(files, node, ProfileConfig))
    check_parameters(profile)
    values = {**derived, **file_values(files, node, AssemblerConfig)}
    known = {each.name for each in fields(AssemblerConfig)}
    values |= {name: value for name, value in own.items() if name in known}
    values = {key: tuple(v) if isinstance(v, list) else v for key, v in values.items()}
    check_parameters(replace(PROFILES[profile.profile], **values))


def robot_description(path: str, arguments: Mapping[str, str]) -> str:
    """Return the URDF of a xacro file with the given arguments.

    Raises
    ------
    NodlidarError
        If xacro fails.
    """
    try:
        return str(xacro.process_file(path, mappings=dict(arguments)).toxml())
    except Exception as error:  # of xacro, XML or a Python expression
        raise NodlidarError(f"xacro cannot process '{path}': {error}") from error
