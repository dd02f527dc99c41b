"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

doctor = command('nodlidar_bringup.commands.doctor')
install_udev_rules = command('nodlidar_bringup.commands.install_udev_rules')
