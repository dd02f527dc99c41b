"""The nodes of one sensor, for the launch files."""

from functools import cached_property
import math
import os
import sys
import tempfile
from typing import Any
import uuid

from launch import LaunchContext
from launch.actions import Shutdown
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from nodlidar_assembler.profiles import PROFILES
from nodlidar_bringup import argument_values
from nodlidar_bringup.ros.launch_arguments import (
    ALL,
    ARGUMENTS,
    BEST_EFFORT,
    CLOUDS,
    defaults,
    DESCRIPTIONS,
    DEVICES,
    OTHER_DRIVERS,
    WITH_FILE,
)
from nodlidar_bringup.ros.shared_files import share
from nodlidar_bringup.ros.tied_node import tied_node
from nodlidar_common.errors import NodlidarError
from nodlidar_common.ldrobot import LD19

# Of a device's node that hangs at a Ctrl-C [s]: launch sends SIGTERM after the first one, and
# SIGKILL after the second one; then the guard switches the device off.
DEVICE_TIMEOUTS = {'sigterm_timeout': '3', 'sigkill_timeout': '2'}


def end_all(event: Any, context: LaunchContext) -> Shutdown | None:
    """Shut down the launch when a process ends, unless it is shutting down already.

    Raises
    ------
    NodlidarError
        If the process failed: the launch ends with exit status 1, which an action cannot set.
    """
    if context.is_shutdown:
        return None
    if event.returncode:
        raise NodlidarError(f'{event.process_name} ended with exit status {event.returncode}')
    return Shutdown(reason=f'{event.process_name} ended')


def text(value: str) -> ParameterValue:
    """Return a parameter of type string, even where YAML would parse a number."""
    return ParameterValue(value, value_type=str)


class Sensor:
    """The nodes of one sensor.

    Parameters
    ----------
    context
        Launch context.
    changed
        Defaults of the launch file that differ from ARGUMENTS.

    Raises
    ------
    NodlidarError
        If an argument is not allowed.
    """

    def __init__(self, context: LaunchContext, **changed: str) -> None:
        self.context = context
        argument_values.expand(context.launch_configurations)
        self.values = {name: context.launch_configurations[name] for name in ARGUMENTS}
        for remark in argument_values.remarks(context.launch_configurations, defaults(**changed)):
            print(remark, file=sys.stderr)
        # Where a launch file that includes this one has pushed a namespace (PushRosNamespace).
        pushed = context.launch_configurations.get('ros_namespace', '')
        own = self.values['namespace']
        self.values['namespace'] = argument_values.joined_namespace(pushed, own)
        self.values = argument_values.calibrated(self.values)
        argument_values.check(self.values)
        self.in_sim = self.values['hardware'] == 'sim'
        if not self.values['base']:
            ego_motion = self.values['ego_motion'] or PROFILES[self.values['profile']].ego_motion
            self.values['base'] = 'route' if ego_motion == 'off' else 'odometry'
        # The frame that stands still in a view.
        self.fixed_frame = 'odom' if self.values['ego_motion'] == 'beam' else 'base_link'
        # The emulators create and remove this folder; the name is unique to this sensor.
        self.links = os.path.join(tempfile.gettempdir(), f'nodlidar-{uuid.uuid4().hex}')

    def nodes(self) -> list[Any]:
        """Return the nodes of this machine; raises NodlidarError if one is not installed."""
        devices = self.devices() if self.values['nodes'] in (ALL, DEVICES) else []
        return [*devices, *self.clouds()] if self.has_clouds else devices

    @property
    def has_clouds(self) -> bool:
        """Whether the nodes that make clouds run on this machine."""
        return self.values['nodes'] in (ALL, CLOUDS)

    def devices(self) -> list[Node]:
        """Return the nodes of the devices, and the robot model."""
        nodes = [self.emulators()] if self.in_sim else []
        if self.values['lidar'] not in (*OTHER_DRIVERS, 'none'):
            nodes.append(self.driver())
        if self.values['servo'] != 'none':
            nodes.append(self.servo())
        if self.values['description'] != 'none':
            nodes.append(self.state_publisher())
        return nodes

    def clouds(self) -> list[Node]:
        """Return the assembler and what shows its clouds."""
        return [self.assembler(), *self.views()]

    def views(self) -> list[Node]:
        """Return what shows the sensor."""
        views = []
        if self.values['rviz'] == 'true':
            views.append(self.rviz())
        if self.values['view'] == 'web':
            views.append(self.viewer())
        return views

    def node(self, package: str, executable: str, **options: Any) -> Node:
        """Return a node in the sensor's namespace."""
        options['namespace'] = self.values['namespace']
        if self.values['own_tf'] == 'true':
            options['arguments'] = [*options.get('arguments', []), *argument_values.OWN_TF]
        return tied_node(self.context, package, executable, **options)

    def frame(self, name: str) -> str:
        """Return a frame or joint of this sensor."""
        return f'{self.values["frame_prefix"]}{name}'

    def topic(self, name: str) -> str:
        """Return the full name of a topic of this sensor."""
        return argument_values.full_name(self.values['namespace'], name)

    def port(self, device: str) -> str:
        """Return a device's port: its own, or in simulation the link to its emulator."""
        links = os.path.join(self.links, device)
        return links if self.in_sim else str(self.values[f'{device}_port'])

    def emulators(self) -> Node:
        """Return the program of the emulated devices."""
        lidar = ['--lidar-link', self.port('lidar')]
        if self.values['lidar'] in OTHER_DRIVERS:
            lidar = ['--frame-id', self.frame('laser')]
        servo = ['--servo-link', self.port('servo')]
        if self.values['servo'] == 'trajectory':
            servo = ['--controller', self.servo_config.controller]
            servo += ['--joint-name', self.frame('nod_joint')]
        return self.node(
            'nodlidar_sim',
            'emulate',
            name='base',
            arguments=[
                *lidar,
                *servo,
                '--scene',
                self.values['scene'],
                f'--route={self.values["route"]}',
                '--base',
                self.values['base'],
                f'--seed={self.values["seed"]}',
                *(['--ideal'] if self.values['ideal'] == 'true' else []),
                *(['--lidar-model', self.values['lidar']] if self.values['lidar'] else []),
                *(['--servo-model', self.values['servo']] if self.values['servo'] else []),
            ],
            on_exit=end_all,
        )

    def driver(self) -> Node:
        """Return the lidar's driver."""
        own = {
            'port': text(self.port('lidar')),
            'frame_id': text(self.frame('laser')),
            'autostart': True,
        }
        executable = 'ldrobot' if self.values['lidar'] == LD19 else 'driver'
        return self.node(
            'nodlidar_driver',
            executable,
            name='driver',
            parameters=[self.driver_file(), own],
            on_exit=end_all,
            **DEVICE_TIMEOUTS,
        )

    def driver_file(self) -> str:
        """Return the parameter file of the lidar's driver."""
        return self.file_or('driver_params', 'ldrobot', self.values['lidar'] == LD19)

    def file_or(self, argument: str, other: str, is_other: bool) -> str:
        """Return a parameter file; by default, if it is for another node, that of this one."""
        file = str(self.values[argument])
        if is_other and file == ARGUMENTS[argument]['default_value']:
            package = f'nodlidar_{argument.removesuffix("_params")}'
            return share(package, f'config/{other}.yaml')
        return file

    def servo(self) -> Node:
        """Return the servo's node."""
        own = {'joint_name': text(self.frame('nod_joint')), 'autostart': True}
        model, executable = self.values['servo'], 'servo'
        if model == 'trajectory':
            executable = 'joint_trajectory'
        else:
            own['port'] = text(self.port('servo'))
            if model:
                own['model'] = text(model)
        return self.node(
            'nodlidar_servo',
            executable,
            name='servo',
            parameters=[self.profile(), self.servo_file(), own],
            on_exit=end_all,
            **DEVICE_TIMEOUTS,
        )

    def servo_file(self) -> str:
        """Return the parameter file of the servo's node."""
        return self.file_or(
            'servo_params', 'joint_trajectory', self.values['servo'] == 'trajectory'
        )

    @cached_property
    def servo_config(self) -> Any:
        """Return the parameters of the servo's node; None if there is no such node."""
        files = [self.profile(), self.servo_file()]
        return argument_values.servo_config(self.values['servo'], files, self.values['namespace'])

    def assembler(self) -> Node:
        """Return the assembler."""
        files = [self.profile()]
        if self.values['lidar'] in WITH_FILE:
            lidar = f'config/lidars/{self.values["lidar"]}.yaml'
            files.append(share('nodlidar_bringup', lidar))
        files += filter(None, [self.values['assembler_params'], self.values['calibration']])
        own: dict[str, Any] = {
            'frame_id': self.frame('nodlidar_base_link'),
            'joint_name': self.frame('nod_joint'),
            'laser_xyz': argument_values.numbers('laser_xyz', self.values['laser_xyz']),
            'laser_rpy': argument_values.numbers('laser_rpy', self.values['laser_rpy']),
        }
        if self.values['lidar'] in BEST_EFFORT:
            own[f'qos_overrides.{self.topic("scan")}.subscription.reliability'] = 'best_effort'
        if self.values['ego_motion']:
            own['ego_motion'] = self.values['ego_motion']
        if self.values['adapt_limits']:
            own['adapt_limits'] = self.values['adapt_limits'] == 'true'
        derived = self.derived()
        argument_values.check_assembler(files, self.values['namespace'], derived, own)
        words = [word for name, value in derived.items() for word in ('-p', f'{name}:={value}')]
        typed = {name: text(v) if isinstance(v, str) else v for name, v in own.items()}
        return self.node(
            'nodlidar_assembler',
            'assembler',
            name='assembler',
            parameters=[*files, typed],
            arguments=['--ros-args', *words],
            on_exit=end_all,
        )

    def derived(self) -> dict[str, Any]:
        """Return the assembler's parameters that follow from the servo and the mount.

        The files come later and take precedence, also those for all nodes, over which values in
        the place of a file would.
        """
        roll, pitch, _ = argument_values.numbers('mount_rpy', self.values['mount_rpy'])
        return {
            **argument_values.servo_limits(self.servo_config),
            'sensor_height': argument_values.sensor_height(self.values),
            'mount_tilt': [math.remainder(each, math.tau) for each in (roll, pitch)],
        }

    def profile(self) -> str:
        """Return the parameter file of the profile; those of the nodes take precedence."""
        return share('nodlidar_bringup', f'config/profiles/{self.values["profile"]}.yaml')

    def state_publisher(self) -> Node:
        """Return the node that publishes the robot model and its transforms."""
        of_model = ('mount_xyz', 'mount_rpy', 'laser_xyz', 'laser_rpy', 'lidar')
        given = {name: self.values[name] for name in of_model} | {'prefix': self.frame('')}
        limits = argument_values.joint_limits(self.servo_config)
        model = str(self.values['description'])
        if model in DESCRIPTIONS:
            model = share('nodlidar_bringup', f'urdf/{model}.urdf.xacro')
        description = argument_values.robot_description(model, given | limits)
        own = {'robot_description': text(description)}
        if self.values['tf_rate']:
            own['publish_frequency'] = argument_values.tf_rate(self.values['tf_rate'])
        return self.node(
            'robot_state_publisher',
            'robot_state_publisher',
            parameters=[self.profile(), own],
            on_exit=end_all,
        )

    def rviz(self) -> Node:
        """Return RViz, with the world standing still."""
        view = share('nodlidar_bringup', 'rviz/nodlidar.rviz')
        return self.node('rviz2', 'rviz2', arguments=['-d', view, '-f', self.fixed_frame])

    def viewer(self) -> Node:
        """Return the viewer; the sensor continues without it."""
        own = {
            'fixed_frame': text(self.fixed_frame),
            'sensor_frame': text(self.frame('nodlidar_base_link')),
        }
        return self.node(
            'nodlidar_viewer',
            'viewer',
            name='viewer',
            parameters=[self.values['viewer_params'], own],
        )
