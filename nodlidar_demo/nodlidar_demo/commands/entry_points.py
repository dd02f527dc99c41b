"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

demo = command('nodlidar_demo.commands.demo')
demo_mapping = command('nodlidar_demo.commands.demo_mapping')
