"""A recorded sensor, for the launch files: a bag in place of the devices."""

import os
from typing import Any

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
from launch import LaunchContext
from launch.actions import ExecuteProcess
from launch_ros.actions import Node
from nodlidar_bringup.ros.launch_arguments import ALL, MAPPING_DEFAULTS
from nodlidar_bringup.ros.sensor import end_all, Sensor
from nodlidar_common.errors import NodlidarError, ParameterError

CLOCK_RATE = 100  # Hz, of the time that the nodes follow
# What the nodes publish themselves must not come from the bag as well.
PLAYED = ('scan', 'joint_states', '/tf', '/tf_static')
TRANSFORMS = ('tf', 'tf_static')


def _end_all_if_failed(event: Any, context: LaunchContext) -> Any:
    return end_all(event, context) if event.returncode else None


class RecordedSensor(Sensor):
    """Plays a bag, whose TF has the nod and odometry, and assembles its clouds.

    When the bag ends, the nodes go on, so that the map can be saved. If it cannot be played, the
    launch ends.

    Parameters
    ----------
    context
        Launch context, whose argument `bag` is the path of the bag.

    Raises
    ------
    NodlidarError
        If ``ros2 bag`` is not installed, or an argument is not allowed.
    """

    def __init__(self, context: LaunchContext) -> None:
        super().__init__(context, **MAPPING_DEFAULTS)
        self._bag = context.launch_configurations['bag']
        if self.values['nodes'] != ALL:
            raise ParameterError('nodes', f'{ALL} with a bag', self.values['nodes'])
        try:
            get_package_share_directory('ros2bag')
        except PackageNotFoundError as error:
            install = 'sudo apt install ros-$ROS_DISTRO-rosbag2'
            raise NodlidarError(f'bag:= needs ros2 bag: {install}') from error
        if not os.path.exists(self._bag):
            raise ParameterError('bag', 'the path of a recorded drive', self._bag)

    def nodes(self) -> list[Any]:
        """Return the player, the assembler and the views."""
        player = ExecuteProcess(cmd=self.player(), output='screen', on_exit=_end_all_if_failed)
        return [player, *self.clouds()]

    def node(self, package: str, executable: str, **options: Any) -> Node:
        """Return a node that follows the time of the bag, and commands no nod."""
        recorded: dict[str, Any] = {'use_sim_time': True}
        if executable == 'assembler':
            recorded['command_nod'] = False
        options['parameters'] = [*options.get('parameters', []), recorded]
        return super().node(package, executable, **options)

    def player(self) -> list[str]:
        """Return the command that plays the bag.

        With own_tf, the transforms are played in the namespace, wherever the bag has them.
        """
        own = TRANSFORMS if self.values['own_tf'] == 'true' else ()
        played = [*PLAYED, *own]
        topics = [topic if topic.startswith('/') else self.topic(topic) for topic in played]
        command = ['ros2', 'bag', 'play', self._bag, '--clock', str(CLOCK_RATE)]
        remaps = ['--remap', *(f'/{topic}:={self.topic(topic)}' for topic in own)] if own else []
        return [*command, '--topics', *topics, *remaps]
