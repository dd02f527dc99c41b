"""Odometry that is sent more often than it is measured."""

from nodlidar_assembler.plausibility.point_error import DISTANCE, LEAST_ERROR
from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np

CHANGES = 10  # of the pose, by which it is judged
MOVING_NS = NS_PER_S // 2  # from change to change; a robot that stands keeps its pose for longer


def held_poses(times_ns: Times, position: Array, orientation: Array) -> str:
    """Return how far points are off as poses are sent again, newly stamped, while it moves.

    Between two measurements the robot then seems to stand, and then to leap.

    Parameters
    ----------
    times_ns, position, orientation
        Stamps [ns], shape (n,), x y z [m], (n, 3), and quaternions x y z w, (n, 4).

    Returns
    -------
    str
        Empty if points are off by less than LEAST_ERROR.
    """
    changed = (np.diff(np.hstack((position, orientation)), axis=0) != 0.0).any(axis=1)
    new = np.append(0, np.flatnonzero(changed) + 1)[-CHANGES - 1 :]
    gaps_ns = np.diff(times_ns[new])
    if len(gaps_ns) < CHANGES or gaps_ns.max() > MOVING_NS:
        return ''
    alike = np.abs(np.sum(orientation[new[1:]] * orientation[new[:-1]], axis=1))
    way = np.linalg.norm(np.diff(position[new], axis=0), axis=1)
    error = np.median(way + DISTANCE * 2.0 * np.arccos(np.minimum(alike, 1.0)))
    samples = np.median(np.diff(new))
    if samples < 2.0 or error < LEAST_ERROR:
        return ''
    gap = np.median(gaps_ns) / 1e6
    return (
        f'odometry is stamped every {gap / samples:.0f} ms, but changes every {gap:.0f} ms: '
        f'points {DISTANCE:g} m away are up to {error * 1e3:.0f} mm off; '
        'stamp each pose once, with the time of its measurement'
    )
