"""Starts one nodding lidar: simulated or real devices, their drivers, the assembler, the model.

A second sensor runs under another namespace, with its frames told apart by a prefix:
`ros2 launch nodlidar_bringup robot.launch.py namespace:=left frame_prefix:=left_`.
"""

import os
import tempfile

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import (
    Command,
    EqualsSubstitution,
    IfElseSubstitution,
    LaunchConfiguration,
    PathJoinSubstitution,
    PythonExpression,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

# The emulated devices' links; the process id keeps two launches apart, the namespace two sensors.
LINKS = os.path.join(tempfile.gettempdir(), f'nodlidar-{os.getpid()}')


def share(package, *path):
    """Return a file in a package's share folder."""
    return PathJoinSubstitution([FindPackageShare(package), *path])


ARGUMENTS = [
    DeclareLaunchArgument(
        'hardware',
        default_value='sim',
        choices=['sim', 'real'],
        description='sim: emulated devices in a simulated scene; real: devices on serial ports',
    ),
    DeclareLaunchArgument(
        'lidar_port',
        default_value='/dev/ttyACM0',
        description='serial port of the lidar (hardware:=real)',
    ),
    DeclareLaunchArgument(
        'servo_port',
        default_value='/dev/ttyUSB0',
        description='serial port of the servo (hardware:=real)',
    ),
    DeclareLaunchArgument(
        'scene',
        default_value='room',
        description='scene (hardware:=sim): room, corner, corridor, crossing, wall or a YAML file',
    ),
    DeclareLaunchArgument(
        'route',
        default_value='',
        description="what the base drives in place of the scene's own route (hardware:=sim): "
        'approach, figure_of_eight, turn or a YAML file',
    ),
    DeclareLaunchArgument(
        'base',
        default_value='route',
        choices=['route', 'odometry', 'cmd_vel'],
        description='the base (hardware:=sim); route: drives it and tells nobody; odometry: '
        'publishes odom and its transform; cmd_vel: publishes, and drives as that topic says',
    ),
    DeclareLaunchArgument(
        'profile',
        default_value='balanced',
        choices=['fast', 'balanced', 'accurate'],
        description='how much accuracy is worth how much time (docs/tradeoffs.md); what the '
        'files of parameters say goes before it',
    ),
    DeclareLaunchArgument(
        'ego_motion',
        default_value='',
        choices=['', 'beam'],
        description='beam: clouds in odom, every beam from where TF says that the robot was; '
        'otherwise as assembler_params says',
    ),
    DeclareLaunchArgument(
        'rviz',
        default_value='false',
        choices=['true', 'false'],
        description='whether to start RViz',
    ),
    DeclareLaunchArgument(
        'namespace',
        default_value='',
        description='namespace of all nodes and topics',
    ),
    DeclareLaunchArgument(
        'frame_prefix',
        default_value='',
        description="put before the sensor's frames and its joint, not before base_link",
    ),
    DeclareLaunchArgument(
        'mount_xyz',
        default_value='0 0 1.0',
        description='nod axis in base_link: x y z [m]; the scenes have it 1 m above the floor',
    ),
    DeclareLaunchArgument(
        'mount_rpy',
        default_value='0 0 0',
        description='orientation of the sensor in base_link: roll pitch yaw [rad]',
    ),
    DeclareLaunchArgument(
        'laser_xyz',
        default_value='0 0 0.080',
        description='optical centre of the lidar in the nodding frame, whose origin is on the nod '
        'axis: x y z [m]; that of the simulated one is the default',
    ),
    DeclareLaunchArgument(
        'laser_rpy',
        default_value='0 0 0',
        description='orientation of the lidar in the nodding frame: roll pitch yaw [rad]',
    ),
    DeclareLaunchArgument(
        'driver_params',
        default_value=share('nodlidar_driver', 'config', 'driver.yaml'),
        description='parameters of the lidar driver, but for port, frame_id and autostart',
    ),
    DeclareLaunchArgument(
        'servo_params',
        default_value=share('nodlidar_servo', 'config', 'servo.yaml'),
        description='parameters of the servo node, but for port, joint_name and autostart',
    ),
    DeclareLaunchArgument(
        'assembler_params',
        default_value=share('nodlidar_assembler', 'config', 'assembler.yaml'),
        description='parameters of the assembler, but for frame_id, joint_name, laser_xyz and '
        'laser_rpy',
    ),
]

NAMESPACE = LaunchConfiguration('namespace')
PROFILE = [
    share('nodlidar_bringup', 'config', 'profiles'),
    '/',
    LaunchConfiguration('profile'),
    '.yaml',
]
IN_SIM = EqualsSubstitution(LaunchConfiguration('hardware'), 'sim')
IN_ODOM = EqualsSubstitution(LaunchConfiguration('ego_motion'), 'beam')


def frame(name):
    """Return a frame or joint of this sensor."""
    return ParameterValue([LaunchConfiguration('frame_prefix'), name], value_type=str)


def numbers(argument):
    """Return an argument's numbers as a list, which is a parameter's value."""
    return PythonExpression(["[float(n) for n in '", LaunchConfiguration(argument), "'.split()]"])


def xacro_argument(name, argument=None):
    """Return the words that give xacro an argument, from that of this file."""
    return [f' {name}:="', LaunchConfiguration(argument or name), '"']


def link(device):
    """Return where a device's emulator is linked to."""
    return [f'{LINKS}/', NAMESPACE, f'/{device}']


def port(device):
    """Return a device's port: its own, or in simulation the link to its emulator."""
    real = LaunchConfiguration(f'{device}_port')
    return ParameterValue(IfElseSubstitution(IN_SIM, link(device), real), value_type=str)


def assembler_params():
    """Return the assembler's YAML files; the later one takes precedence."""
    params = LaunchConfiguration('assembler_params')
    beam = share('nodlidar_bringup', 'config', 'ego_motion.yaml')
    return [params, IfElseSubstitution(IN_ODOM, beam, params)]


def end_all(event, context):
    """Shut everything down when a process ends, unless that is under way already."""
    return None if context.is_shutdown else Shutdown(reason=f'{event.process_name} ended')


def generate_launch_description():
    """Return the sensor's nodes; the end of any of them, but not of RViz, ends all."""
    emulators = Node(
        package='nodlidar_sim',
        executable='emulate',
        name='base',
        namespace=NAMESPACE,
        arguments=[
            '--lidar-link',
            link('lidar'),
            '--servo-link',
            link('servo'),
            '--scene',
            LaunchConfiguration('scene'),
            ['--route=', LaunchConfiguration('route')],
            '--base',
            LaunchConfiguration('base'),
        ],
        output='screen',
        condition=IfCondition(IN_SIM),
        on_exit=end_all,
    )
    driver = Node(
        package='nodlidar_driver',
        executable='driver',
        name='driver',
        namespace=NAMESPACE,
        parameters=[
            LaunchConfiguration('driver_params'),
            {'port': port('lidar'), 'frame_id': frame('laser'), 'autostart': True},
        ],
        output='screen',
        on_exit=end_all,
    )
    servo = Node(
        package='nodlidar_servo',
        executable='servo',
        name='servo',
        namespace=NAMESPACE,
        parameters=[
            PROFILE,
            LaunchConfiguration('servo_params'),
            {'port': port('servo'), 'joint_name': frame('nod_joint'), 'autostart': True},
        ],
        output='screen',
        on_exit=end_all,
    )
    assembler = Node(
        package='nodlidar_assembler',
        executable='assembler',
        name='assembler',
        namespace=NAMESPACE,
        parameters=[
            PROFILE,
            *assembler_params(),
            {
                'frame_id': frame('nodlidar_base_link'),
                'joint_name': frame('nod_joint'),
                'laser_xyz': numbers('laser_xyz'),
                'laser_rpy': numbers('laser_rpy'),
            },
        ],
        output='screen',
        on_exit=end_all,
    )
    description = Command(
        [
            'xacro "',
            share('nodlidar_bringup', 'urdf', 'robot.urdf.xacro'),
            '"',
            *xacro_argument('prefix', 'frame_prefix'),
            *xacro_argument('mount_xyz'),
            *xacro_argument('mount_rpy'),
            *xacro_argument('laser_xyz'),
            *xacro_argument('laser_rpy'),
        ]
    )
    state_publisher = Node(
        package='robot_state_publisher',
        executable='robot_state_publisher',
        namespace=NAMESPACE,
        parameters=[{'robot_description': ParameterValue(description, value_type=str)}],
        output='screen',
        on_exit=end_all,
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        namespace=NAMESPACE,
        arguments=[
            '-d',
            share('nodlidar_bringup', 'rviz', 'nodlidar.rviz'),
            '-f',
            IfElseSubstitution(IN_ODOM, 'odom', 'base_link'),
        ],
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    return LaunchDescription(
        [
            *ARGUMENTS,
            emulators,
            driver,
            servo,
            assembler,
            state_publisher,
            rviz,
        ]
    )
