"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

view_bag = command('nodlidar_viewer.commands.view_bag')
