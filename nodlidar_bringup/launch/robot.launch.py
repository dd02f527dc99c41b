"""Starts one nodding lidar: simulated or real devices, their drivers, the assembler, the model.

A second sensor needs a namespace, and a prefix for its frames:
`ros2 launch nodlidar_bringup robot.launch.py namespace:=left frame_prefix:=left_`.

All arguments are checked before any node starts. When any node but RViz and the viewer ends, all
are shut down. When the launch process itself ends, even by SIGKILL, the kernel sends SIGTERM to
the nodes.
"""

from launch import LaunchDescription
from launch.actions import OpaqueFunction
from nodlidar_bringup.ros.discovery import announce_often
from nodlidar_bringup.ros.launch_arguments import declared
from nodlidar_bringup.ros.sensor import Sensor


def generate_launch_description():
    """Return the launch arguments and the function that creates the nodes from them."""
    announce_often()
    return LaunchDescription(
        [*declared(), OpaqueFunction(function=lambda context: Sensor(context).nodes())]
    )
