"""Starts one nodding lidar and the mapper; by default on a simulated drive through a building.

All arguments of robot.launch.py apply. Drive by the topic cmd_vel: `base:=cmd_vel`. On a robot:
`hardware:=real`; the robot supplies the transform from odom to base_link.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from nodlidar_bringup import arguments
from nodlidar_bringup.ros.discovery import announce_often
from nodlidar_bringup.ros.launch_arguments import declared, share
from nodlidar_bringup.ros.sensor import end_all, Sensor, text


def nodes(context):
    """Return the nodes of the sensor and the mapper."""
    params, folder = (context.launch_configurations[name] for name in ('mapper_params', 'map'))
    arguments.check_parameter_file('mapper_params', params)
    sensor = Sensor(context)
    sensor.fixed_frame = 'map'
    mapper = sensor.node(
        'nodlidar_mapper',
        'mapper',
        name='mapper',
        parameters=[params, {'map_folder': text(folder)}],
        on_exit=end_all,
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
    ]
    sensor = declared(scene='building', profile='slam', base='odometry')
    return LaunchDescription([*sensor, *own, OpaqueFunction(function=nodes)])
