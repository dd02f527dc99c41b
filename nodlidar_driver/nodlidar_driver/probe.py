"""The command `probe`: what a lidar is, how fast it scans, how well it is dated, what it sees.

It reads some seconds of scans. The laser of a Hokuyo is off afterwards, also after Ctrl-C or an
error; an LD06 or LD19 takes no commands.
"""

from nodlidar_common.command_line import command

main = command('probe', 'nodlidar_driver.probe_command:probe', __doc__)
