"""`ros2 run nodlidar_mapper map_bag`: maps a recorded drive.

Reads scans, joint states and odometry from TF. Writes into a folder: the points of the map
(map.ply), its occupancy grid as map_server reads it (map.pgm, map.yaml), a picture (map.png), the
map to go on from (keyframes.npz), and the poses of the sensor as lines of time, position and
quaternion (trajectory.txt).
"""

from nodlidar_common.command_line import command

main = command('map_bag', 'nodlidar_mapper.command:map_drive', __doc__)
