"""How late odometry is, by the turns of the matched clouds."""

from collections.abc import Sequence

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_common.nod import NS_PER_S
from nodlidar_mapper.geometry.poses import Array
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

INSTANTS = 30  # of each cloud
OUTLIER = 0.005  # turns that differ by more count less [rad]
STEP = 0.01  # of the numerical derivative: about a sample of odometry [s]
LONGEST = 0.5  # s
LEAST_INFORMATION = 1e-12  # of a robot that never turns
LEAST_STEPS = 10  # from cloud to cloud
KNOWN_ERROR = 0.05  # standard error with which the delay is known, at most [s]
# A delay that is worth a parameter has at least this size [s], and so many standard errors.
LEAST_DELAY, SURE = 0.03, 2.5


def odometry_delay(
    clouds: Sequence[Points], poses: Array, matched: NDArray[np.bool_], odometry: Odometry
) -> tuple[float, float]:
    """Return by how much the stamps of odometry are late, and the standard error [s].

    A cloud that was deskewed by late odometry is bent where the robot began or ceased to turn:
    each point is off by what odometry lacked at its instant. As outliers count little in a match,
    the pose fits most of the points. So the heading is that of odometry, plus the median of
    y(s + delay) - y(s) over the instants s of the points, where y is the heading by odometry. A
    share by which turns are miscounted is estimated as well. A robot that never turns, or always
    alike, does not show the delay: the error is then large, and infinite for a few clouds.

    Parameters
    ----------
    clouds
        Deskewed clouds, n of them.
    poses, matched
        Poses of the clouds in the map, shape (n, 4, 4); which of them are believed, shape (n,).
    odometry
        Of the clouds' frame.
    """
    begin_ns = odometry.time_ns[0]
    known = (odometry.time_ns - begin_ns) / NS_PER_S
    heading = _heading(Rotation.from_quat(odometry.poses.orientation).as_matrix())
    stamps = np.array([cloud.stamp_ns - begin_ns for cloud in clouds]) / NS_PER_S
    instants = np.stack([_some(cloud.time_ns - begin_ns) for cloud in clouds]) / NS_PER_S
    by_odometry = np.interp(instants, known, heading)
    beyond_odometry = _heading(poses) - np.interp(stamps, known, heading)
    steps = matched[1:] & matched[:-1]
    if np.count_nonzero(steps) < LEAST_STEPS:
        return 0.0, np.inf

    def unexplained(guess: Array) -> Array:
        delay, scale = guess
        lacking = scale * np.interp(instants + delay, known, heading) - by_odometry
        turn = np.diff(beyond_odometry - np.median(lacking, axis=1))[steps]
        # Half turns between clouds may have been counted otherwise.
        return np.asarray(np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi)

    found = least_squares(
        unexplained,
        [0.0, 1.0],
        bounds=([-LONGEST, 0.5], [LONGEST, 2.0]),
        loss='soft_l1',
        f_scale=OUTLIER,
        diff_step=STEP,
        x_scale=[0.1, 0.1],
    )
    information = found.jac.T @ found.jac + LEAST_INFORMATION * np.eye(2)  # weighted by the loss
    variance = 2.0 * found.cost / max(np.count_nonzero(steps) - 2, 1)
    return float(found.x[0]), float(np.sqrt(variance * np.linalg.inv(information)[0, 0]))


def is_worth_setting(delay: float, error: float) -> bool:
    """Return whether a delay with a standard error [s] should be taken out."""
    return error <= KNOWN_ERROR and abs(delay) >= max(LEAST_DELAY, SURE * error)


def _heading(rotations: Array) -> Array:
    """Return the continuous heading of rotations or poses (n, k, k) [rad], shape (n,)."""
    return np.unwrap(np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]))


def _some(times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return evenly chosen instants of a cloud's points, shape (INSTANTS,)."""
    chosen = np.linspace(0, len(times_ns) - 1, INSTANTS).astype(np.intp)
    return np.asarray(times_ns[chosen])
