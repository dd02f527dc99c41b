"""Origins near the robot for clouds far from that of odometry, so that float32 keeps millimetres.

A float32 has steps of 1 mm from 8192 m on, and of 6 cm at a million metres. So the origin of a
cloud is the point nearest to the robot whose coordinates are whole multiples of SPACING: that of
odometry itself up to 8192 m from it, and from there on one that keeps the robot within 8192 m of
it in each coordinate. The shift is whole metres, which a float64 takes off without rounding.
"""

from collections.abc import Sequence

from nodlidar_assembler.clouds.ego_motion import OdometryError

# Between origins [m].
SPACING = 16_384
# Beyond this [m], odometry itself, of float64, loses millimetres.
FARTHEST = 1e12

Origin = tuple[int, int, int]
OF_ODOMETRY: Origin = (0, 0, 0)


def origin_near(position: Sequence[float]) -> Origin:
    """Return the origin [m] for points around a position x, y, z [m], in the frame of odometry.

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
    """Return the name of the frame that has an origin: each has its own, which never moves."""
    if origin == OF_ODOMETRY:
        return odom_frame
    return '_'.join((odom_frame, *map(str, origin)))
