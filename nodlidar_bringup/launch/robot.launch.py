"""Starts one nodding lidar: simulated or real devices, their drivers, the assembler, the model.

A second sensor runs under another namespace, with its frames told apart by a prefix:
`ros2 launch nodlidar_bringup robot.launch.py namespace:=left frame_prefix:=left_`.

All arguments are checked before any node is started. The end of any node but RViz ends all; when
the launch itself is gone, even killed, the kernel ends them (SIGTERM).
"""

import os
import tempfile
import uuid

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch_ros.parameter_descriptions import ParameterValue
from nodlidar_bringup import arguments
from nodlidar_bringup.discovery import announce_often
from nodlidar_bringup.ros.tied_node import tied_node

TF_RATE = 1000.0  # Hz, at most: a transform for each joint state, or TF is late by up to 50 ms


def share(package, path):
    """Return a file in a package's share folder."""
    return os.path.join(get_package_share_directory(package), path)


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
        description='the base (hardware:=sim); route: follows the route without odometry; '
        'odometry: publishes odom and its transform; cmd_vel: publishes, and drives as that topic '
        'says',
    ),
    DeclareLaunchArgument(
        'profile',
        default_value='balanced',
        choices=['fast', 'balanced', 'accurate'],
        description='how much accuracy is worth how much time (docs/tradeoffs.md); the '
        'parameter files override it',
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
        default_value=share('nodlidar_driver', 'config/driver.yaml'),
        description='parameters of the lidar driver, but for port, frame_id and autostart',
    ),
    DeclareLaunchArgument(
        'servo_params',
        default_value=share('nodlidar_servo', 'config/servo.yaml'),
        description='parameters of the servo node, but for port, joint_name and autostart',
    ),
    DeclareLaunchArgument(
        'assembler_params',
        default_value=share('nodlidar_assembler', 'config/assembler.yaml'),
        description='parameters of the assembler, but for frame_id, joint_name, laser_xyz and '
        'laser_rpy',
    ),
]


def end_all(event, context):
    """Shut everything down when a process ends, unless that is under way already."""
    return None if context.is_shutdown else Shutdown(reason=f'{event.process_name} ended')


def text(value):
    """Return a parameter that stays a text, whatever YAML would make of it."""
    return ParameterValue(value, value_type=str)


class Sensor:
    """The nodes of one sensor.

    Parameters
    ----------
    context
        Of the launch.

    Raises
    ------
    NodlidarError
        If an argument is not as it must be.
    """

    def __init__(self, context):
        self.context = context
        self.values = {each.name: context.launch_configurations[each.name] for each in ARGUMENTS}
        arguments.check(self.values)
        self.in_sim = self.values['hardware'] == 'sim'
        self.in_odom = self.values['ego_motion'] == 'beam'
        # Emulators make this folder and remove it; no other sensor has the same.
        self.links = os.path.join(tempfile.gettempdir(), f'nodlidar-{uuid.uuid4().hex}')

    def nodes(self):
        """Return all nodes; raises NodlidarError if one is not installed."""
        nodes = [self.driver(), self.servo(), self.assembler(), self.state_publisher()]
        if self.in_sim:
            nodes.insert(0, self.emulators())
        if self.values['rviz'] == 'true':
            nodes.append(self.rviz())
        return nodes

    def node(self, package, executable, **options):
        """Return a node in the sensor's namespace."""
        namespace = self.values['namespace']
        return tied_node(self.context, package, executable, namespace=namespace, **options)

    def frame(self, name):
        """Return a frame or joint of this sensor."""
        return self.values['frame_prefix'] + name

    def port(self, device):
        """Return a device's port: its own, or in simulation the link to its emulator."""
        return os.path.join(self.links, device) if self.in_sim else self.values[f'{device}_port']

    def emulators(self):
        """Return the program of the emulated devices."""
        return self.node(
            'nodlidar_sim',
            'emulate',
            name='base',
            arguments=[
                '--lidar-link',
                self.port('lidar'),
                '--servo-link',
                self.port('servo'),
                '--scene',
                self.values['scene'],
                f'--route={self.values["route"]}',
                '--base',
                self.values['base'],
            ],
            on_exit=end_all,
        )

    def driver(self):
        """Return the lidar's driver."""
        own = {
            'port': text(self.port('lidar')),
            'frame_id': text(self.frame('laser')),
            'autostart': True,
        }
        return self.node(
            'nodlidar_driver',
            'driver',
            name='driver',
            parameters=[self.values['driver_params'], own],
            on_exit=end_all,
        )

    def servo(self):
        """Return the servo's node."""
        own = {
            'port': text(self.port('servo')),
            'joint_name': text(self.frame('nod_joint')),
            'autostart': True,
        }
        return self.node(
            'nodlidar_servo',
            'servo',
            name='servo',
            parameters=[self.profile(), self.values['servo_params'], own],
            on_exit=end_all,
        )

    def assembler(self):
        """Return the assembler."""
        files = [self.profile(), self.values['assembler_params']]
        if self.in_odom:
            files.append(share('nodlidar_bringup', 'config/ego_motion.yaml'))
        own = {
            'frame_id': text(self.frame('nodlidar_base_link')),
            'joint_name': text(self.frame('nod_joint')),
            'laser_xyz': arguments.numbers('laser_xyz', self.values['laser_xyz']),
            'laser_rpy': arguments.numbers('laser_rpy', self.values['laser_rpy']),
        }
        return self.node(
            'nodlidar_assembler',
            'assembler',
            name='assembler',
            parameters=[*files, own],
            on_exit=end_all,
        )

    def profile(self):
        """Return the parameter file of the profile; those of the nodes take precedence."""
        return share('nodlidar_bringup', f'config/profiles/{self.values["profile"]}.yaml')

    def state_publisher(self):
        """Return the node that publishes the robot model and its transforms."""
        places = ('mount_xyz', 'mount_rpy', 'laser_xyz', 'laser_rpy')
        description = arguments.robot_description(
            share('nodlidar_bringup', 'urdf/robot.urdf.xacro'),
            {name: self.values[name] for name in places} | {'prefix': self.frame('')},
        )
        return self.node(
            'robot_state_publisher',
            'robot_state_publisher',
            parameters=[{'robot_description': text(description), 'publish_frequency': TF_RATE}],
            on_exit=end_all,
        )

    def rviz(self):
        """Return RViz, with the world standing still."""
        view = share('nodlidar_bringup', 'rviz/nodlidar.rviz')
        fixed = 'odom' if self.in_odom else 'base_link'
        return self.node('rviz2', 'rviz2', arguments=['-d', view, '-f', fixed])


def generate_launch_description():
    """Return the launch arguments, and what makes the nodes once these are known."""
    announce_often()
    return LaunchDescription(
        [*ARGUMENTS, OpaqueFunction(function=lambda context: Sensor(context).nodes())]
    )
