"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

probe = command('nodlidar_driver.commands.probe')
