"""The entry points of the commands: what `ros2 run` calls."""

from nodlidar_common.command_line import command

assemble_bag = command('nodlidar_assembler.commands.assemble_bag')
calibrate = command('nodlidar_assembler.commands.calibrate')
