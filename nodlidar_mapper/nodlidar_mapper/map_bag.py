"""`ros2 run nodlidar_mapper map_bag`: maps a recorded drive.

Reads scans, joint states and odometry from TF. Writes into a folder: the points of the map
(map.ply), its occupancy grid as map_server reads it (map.pgm, map.yaml), a picture (map.png), the
map to go on from (keyframes.npz), and the poses of the sensor as lines of time, position and
quaternion (trajectory.txt).
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Map a bag; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_mapper.command import map_drive

        map_drive(argv, __doc__)

    return run('map_bag', work)


if __name__ == '__main__':
    sys.exit(main())
