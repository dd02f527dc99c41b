"""Starts one nodding lidar and the mapper; by default on a simulated drive through a building.

All arguments of robot.launch.py apply, but for other profiles than slam and `ego_motion:=beam`.
Drive by the topic cmd_vel: `base:=cmd_vel`. On a robot: `hardware:=real`; the robot supplies the
transform from odom to base_link. `bag:=PATH` plays a recorded drive in place of the devices
(`ros2 run nodlidar_mapper map_bag` is faster).
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from nodlidar_bringup import argument_values
from nodlidar_bringup.ros.discovery import announce_often
from nodlidar_bringup.ros.launch_arguments import declared, MAPPING_DEFAULTS
from nodlidar_bringup.ros.recorded_sensor import RecordedSensor
from nodlidar_bringup.ros.sensor import end_all, Sensor, text
from nodlidar_bringup.ros.shared_files import share

# Time for which the launch waits until the mapper has saved the map [s]. Without one to save, the
# launch waits as for any node: a mapper that stands still does not end at all.
SAVING = '600'


def nodes(context):
    """Return the nodes of the sensor, real, simulated or recorded, and the mapper."""
    given = context.launch_configurations
    sensor = RecordedSensor(context) if given['bag'] else Sensor(context, **MAPPING_DEFAULTS)
    if not sensor.has_clouds:
        return sensor.nodes()
    argument_values.check_mapping(given)
    file = given['mapper_params']
    argument_values.check_parameter_file('mapper_params', file, sensor.values['namespace'])
    sensor.fixed_frame = 'map'
    folders = {'map_folder': given['map'], 'save_folder': given['save']}
    waiting = {'sigterm_timeout': SAVING} if given['save'] else {}
    mapper = sensor.node(
        'nodlidar_mapper',
        'mapper',
        name='mapper',
        parameters=[file, *({key: text(value)} for key, value in folders.items() if value)],
        on_exit=end_all,
        **waiting,
    )
    return [*sensor.nodes(), mapper]


def generate_launch_description():
    """Return the launch arguments and the function that creates the nodes from them."""
    announce_often()
    own = [
        DeclareLaunchArgument(
            'mapper_params',
            default_value=share('nodlidar_mapper', 'config/mapper.yaml'),
            description='parameter file of the mapper',
        ),
        DeclareLaunchArgument(
            'map',
            default_value='',
            description='folder of a saved map in which the robot is to be found; if empty, a new '
            'map begins',
        ),
        DeclareLaunchArgument(
            'save',
            default_value='',
            description='folder in which the map is saved when the launch ends, whatever ends it, '
            'into one of its own that is named by the time; if empty, it is not saved',
        ),
        DeclareLaunchArgument(
            'bag',
            default_value='',
            description='recorded drive with scans, joint states and TF, played in place of the '
            'devices; needs ros2 bag',
        ),
    ]
    return LaunchDescription([*declared(**MAPPING_DEFAULTS), *own, OpaqueFunction(function=nodes)])
