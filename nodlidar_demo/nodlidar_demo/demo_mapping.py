"""Drives a simulated building and maps it, many times faster than real time.

Leaves in the output folder a bag of the drive, the map (map.ply, map.pgm, map.yaml,
keyframes.npz), the path, and a picture of the map beside the true floor plan.
"""

from nodlidar_common.command_line import command

main = command('demo_mapping', 'nodlidar_demo.mapped_drive:map_simulated_drive', __doc__)
