"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

map_bag = command('nodlidar_mapper.commands.map_bag')
