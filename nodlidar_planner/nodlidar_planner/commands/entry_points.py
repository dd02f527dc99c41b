"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

plan_scan = command('nodlidar_planner.commands.plan_scan')
