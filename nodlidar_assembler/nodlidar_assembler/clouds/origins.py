"""Origins near the robot, so that float32 keeps millimetres far from the origin of odometry.

A float32 has steps of 1 mm from 8192 m on, and of 6 cm at a million metres. The origin of a cloud
is therefore the point nearest to the robot whose coordinates are multiples of SPACING: the robot
is at most 8192 m from it in each coordinate. Up to 8192 m from the origin of odometry, it is that
origin. The shift is in whole metres, which a float64 subtracts without rounding.
"""

from collections.abc import Sequence

from nodlidar_assembler.clouds.ego_motion import OdometryError

SPACING = 16_384  # of origins [m]
FARTHEST = 1e12  # beyond this [m], float64 odometry itself loses millimetres

Origin = tuple[int, int, int]
OF_ODOMETRY: Origin = (0, 0, 0)


def origin_near(position: Sequence[float]) -> Origin:
    """Return the origin [m] for points near a position x, y, z [m], both in `odom`.

    Raises
    ------
    OdometryError
        If the position is beyond FARTHEST.
    """
    farthest = max(map(abs, position))
    if not farthest <= FARTHEST:
        raise OdometryError(f'odometry beyond {FARTHEST:g} m loses millimetres', f'{farthest:g} m')
    x, y, z = (SPACING * round(float(coordinate) / SPACING) for coordinate in position)
    return x, y, z


def frame_of(origin: Origin, odom_frame: str) -> str:
    """Return the name of the fixed frame of an origin."""
    if origin == OF_ODOMETRY:
        return odom_frame
    return '_'.join((odom_frame, *map(str, origin)))
