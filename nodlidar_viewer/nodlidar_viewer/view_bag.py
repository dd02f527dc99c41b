"""`ros2 run nodlidar_viewer view_bag`: replays a recording on a page in a browser.

Reads scans and joint states and, if there are any, transforms from odom, the frame of the clouds
then.
"""

from nodlidar_common.command_line import command

main = command('view_bag', 'nodlidar_viewer.replay_command:replay_bag', __doc__)
