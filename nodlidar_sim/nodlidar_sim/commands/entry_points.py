"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

emulate = command('nodlidar_sim.commands.emulate')
