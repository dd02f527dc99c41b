"""The command `setup`: finds a servo, shows what it is, and sets it up for the servo node.

It asks before each change, writes with the torque off, reads back, and ends with the command that
starts the nod. It never moves the motor.
"""

from nodlidar_common.command_line import command

main = command('setup', 'nodlidar_servo.setup.terminal:set_up', __doc__)
