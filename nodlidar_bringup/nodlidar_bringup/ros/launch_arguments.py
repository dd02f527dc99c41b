"""The arguments of the launch files. nodlidar_bringup.argument_values checks their values."""

from typing import Any

from launch.actions import DeclareLaunchArgument
from nodlidar_assembler.profiles import PROFILES
from nodlidar_bringup.ros.shared_files import share
from nodlidar_common.ldrobot import LD19
from nodlidar_servo.models.models import MODELS
from nodlidar_sim.devices.make_devices import WITH_BYTES
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS

OTHER_DRIVERS = tuple(OTHER_LIDARS)
WITH_FILE = (*OTHER_DRIVERS, LD19)  # each in config/lidars, for the assembler
# Drivers that publish best effort: their scans reach no reliable subscription.
BEST_EFFORT = tuple(name for name, lidar in OTHER_LIDARS.items() if lidar.best_effort)

DESCRIPTIONS = ('robot', 'ros2_control')  # each is a file in urdf
# The nodes of this machine: all, or those of one of two machines.
ALL, DEVICES, CLOUDS = 'all', 'devices', 'clouds'

ARGUMENTS: dict[str, dict[str, Any]] = {
    'hardware': {
        'default_value': 'sim',
        'choices': ['sim', 'real'],
        'description': 'sim: emulated devices in a simulated scene; real: devices on serial ports',
    },
    'nodes': {
        'default_value': ALL,
        'choices': [ALL, DEVICES, CLOUDS],
        'description': 'devices: only driver, servo, simulated devices and robot model; clouds: '
        'only assembler, mapper and what shows them, on another machine with the same arguments '
        '(docs/network.md)',
    },
    'lidar_port': {
        'default_value': '/dev/ttyACM0',
        'description': 'serial port of the lidar (hardware:=real)',
    },
    'servo_port': {
        'default_value': '/dev/ttyUSB0',
        'description': 'serial port of the servo (hardware:=real)',
    },
    'lidar': {
        'default_value': '',
        'choices': ['', *WITH_BYTES, *OTHER_DRIVERS, 'none'],
        'description': 'LD19, also for an LD06; the model of a Hokuyo lidar (hardware:=sim; a '
        'real one says itself what it is); or the driver of another lidar that publishes scan, '
        'with what the assembler must know of it (docs/lidars.md), in simulation also with that '
        'lidar; none: any other driver (hardware:=real)',
    },
    'servo': {
        'default_value': '',
        'choices': ['', *MODELS, 'trajectory', 'none'],
        'description': 'model of the servo; trajectory: a joint that ros2_control moves by a '
        'joint_trajectory_controller, in simulation also with that controller; none: no servo '
        'node, another node moves the joint and publishes joint_states (hardware:=real); if '
        'empty, servo_params decides',
    },
    'scene': {
        'default_value': 'room',
        'description': 'scene (hardware:=sim): room, building, corner, corridor, crossing, wall '
        'or a YAML file',
    },
    'route': {
        'default_value': '',
        'description': "route of the base instead of the scene's own (hardware:=sim): approach, "
        'figure_of_eight, turn or a YAML file',
    },
    'ideal': {
        'default_value': 'false',
        'choices': ['true', 'false'],
        'description': 'true: simulated devices and odometry without errors (hardware:=sim); '
        'false: with those that the scene names',
    },
    'seed': {
        'default_value': '0',
        'description': 'of the random errors of devices and odometry (hardware:=sim): a whole '
        'number from 0',
    },
    'base': {
        'default_value': '',
        'choices': ['', 'route', 'odometry', 'cmd_vel'],
        'description': 'simulated base (hardware:=sim); route: follows the route without '
        'publishing odometry; odometry: also publishes odom and its transform; cmd_vel: '
        'publishes both, and drives by the topic cmd_vel; empty: odometry with profile:=slam, '
        'ego_motion:=beam or deskew, else route',
    },
    'profile': {
        'default_value': 'balanced',
        'choices': [*PROFILES],
        'description': 'fast or balanced: trades computation time for accuracy '
        '(docs/tradeoffs.md); slam: one deskewed cloud per sweep (docs/slam.md); '
        'the parameter files override it',
    },
    'ego_motion': {
        'default_value': '',
        'choices': ['', 'beam', 'deskew'],
        'description': "beam: clouds in odom, each beam placed by the robot's pose from TF at its "
        'instant; deskew: the same points as the robot sees them at the instant of the last one; '
        'if empty, assembler_params decides',
    },
    'adapt_limits': {
        'default_value': '',
        'choices': ['', 'true', 'false'],
        'description': 'true: limits and speed of the nod follow the median range ahead, so that '
        'a band of heights stays covered (docs/adaptive_limits.md); if empty, assembler_params '
        'decides',
    },
    'rviz': {
        'default_value': 'false',
        'choices': ['true', 'false'],
        'description': 'whether to start RViz',
    },
    'view': {
        'default_value': 'none',
        'choices': ['none', 'web'],
        'description': 'web: serve a page that shows the sensor live in a browser, and print its '
        'address (docs/viewer.md)',
    },
    'namespace': {
        'default_value': '',
        'description': 'namespace of all nodes and topics',
    },
    'own_tf': {
        'default_value': 'false',
        'choices': ['true', 'false'],
        'description': 'true: the transforms of these nodes are on tf and tf_static in the '
        'namespace, for several robots on one network (docs/network.md)',
    },
    'tf_rate': {
        'default_value': '',
        'description': 'highest rate of the transform of the nod, for RViz and other nodes that '
        'place scans by TF [Hz]; clouds need no transform of the nod; empty: that of the profile, '
        '20 Hz or with fast 10 Hz',
    },
    'frame_prefix': {
        'default_value': '',
        'description': "prefix of the sensor's frames and its joint, but not of base_link",
    },
    'mount_xyz': {
        'default_value': '0 0 1.0',
        'description': 'position of the nod axis in base_link: x y z [m]; 1 m above the floor in '
        'the scenes',
    },
    'mount_rpy': {
        'default_value': '0 0 0',
        'description': 'orientation of the sensor in base_link: roll pitch yaw [rad]; a positive '
        'pitch turns the beams down, after REP 103',
    },
    'laser_xyz': {
        'default_value': '0 0 0.080',
        'description': 'optical centre of the lidar in the nodding frame, whose origin is on the '
        'nod axis: x y z [m]; the default is that of the simulated lidar',
    },
    'laser_rpy': {
        'default_value': '0 0 0',
        'description': 'orientation of the lidar in the nodding frame: roll pitch yaw [rad]; a '
        'positive pitch turns the beams down, after REP 103',
    },
    'description': {
        'default_value': 'robot',
        'description': 'robot model: robot; ros2_control, the same with a joint that '
        'ros2_control moves; or a xacro file like urdf/robot.urdf.xacro; none: no '
        'robot_state_publisher, because the description of your robot has the sensor '
        '(urdf/nodlidar.urdf.xacro)',
    },
    'driver_params': {
        'default_value': share('nodlidar_driver', 'config/driver.yaml'),
        'description': 'parameter file of the driver, but for port, frame_id and autostart',
    },
    'servo_params': {
        'default_value': share('nodlidar_servo', 'config/servo.yaml'),
        'description': 'parameter file of the servo node, but for port, joint_name and autostart',
    },
    'assembler_params': {
        'default_value': share('nodlidar_assembler', 'config/assembler.yaml'),
        'description': 'parameter file of the assembler, but for frame_id, joint_name, laser_xyz '
        'and laser_rpy',
    },
    'calibration': {
        'default_value': '',
        'description': 'file that the command calibrate of nodlidar_assembler wrote: delay and '
        'zero of the joint, place of the lidar; overrides assembler_params, laser_xyz and '
        'laser_rpy',
    },
    'viewer_params': {
        'default_value': share('nodlidar_viewer', 'config/viewer.yaml'),
        'description': 'parameter file of the viewer, but for fixed_frame and sensor_frame '
        '(view:=web)',
    },
}


# Defaults of mapping.launch.py where they differ.
MAPPING_DEFAULTS = {'scene': 'building', 'profile': 'slam', 'base': 'odometry'}


def declared(**changed: str) -> list[DeclareLaunchArgument]:
    """Return the arguments, some with other defaults."""
    return [
        DeclareLaunchArgument(name, **(ARGUMENTS[name] | {'default_value': default}))
        for name, default in defaults(**changed).items()
    ]


def defaults(**changed: str) -> dict[str, str]:
    """Return the default of each argument, some changed."""
    return {name: each['default_value'] for name, each in ARGUMENTS.items()} | changed
