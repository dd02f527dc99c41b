"""`ros2 run nodlidar_assembler assemble_bag`: assembles the clouds of a recorded bag.

The clouds are those that the assembler node publishes for the same messages and parameters.
"""

from nodlidar_common.command_line import command

main = command('assemble_bag', 'nodlidar_assembler.bags.command:assemble', __doc__)
