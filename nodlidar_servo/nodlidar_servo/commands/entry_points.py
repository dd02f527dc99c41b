"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

setup = command('nodlidar_servo.commands.setup')
