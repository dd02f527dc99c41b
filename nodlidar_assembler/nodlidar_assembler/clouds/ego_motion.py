"""The pose of the robot at the instant of each beam, from odometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from nodlidar_assembler.clouds.odometry_steps import dots, lengths, Steps
from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ScanError
from nodlidar_common.parameters import parameter
from nodlidar_common.pose import Pose
from nodlidar_common.transforms import LENGTH_TOLERANCE
import numpy as np
from numpy.typing import NDArray
from transforms3d.quaternions import mat2quat

_OVER_LIMIT = (
    'odometry more than {} s apart',
    'odometry jumps: it moves faster than {} m/s',
    'odometry jumps: it turns faster than {} rad/s',
)
_UNMOUNTED = Pose.from_xyzrpy((0.0,) * 6)


class OdometryError(ScanError):
    """Odometry does not determine the poses of a scan's beams."""


@dataclass(frozen=True)
class OdometryConfig:
    """Odometry."""

    max_odometry_gap: float = parameter(
        0.2,
        'Longest time between odometry samples to interpolate over',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    max_robot_speed: float = parameter(
        5.0,
        'Odometry that moves faster between two samples counts as a jump',
        unit='m/s',
        minimum=0.01,
        maximum=100.0,
    )
    max_robot_turn_rate: float = parameter(
        10.0,
        'Odometry that turns faster between two samples counts as a jump',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    odometry_delay: float = parameter(
        0.0,
        'Delay of odometry stamps after the measurement; map_bag estimates it',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )
    odometry_period: float = parameter(
        0.0,
        'Period of odometry whose stamps jitter, as of arrival: instants are taken to be so far '
        'apart; 0 takes the stamps as they are. /diagnostics and map_bag name it if it is needed',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses of a frame in its parent frame.

    Attributes
    ----------
    position
        Positions of the origin [m], shape (n, 3).
    orientation
        Unit quaternions x, y, z, w, shape (n, 4).
    """

    position: Array
    orientation: Array

    def __getitem__(self, chosen: slice | NDArray[np.intp]) -> Poses:
        return Poses(self.position[chosen], self.orientation[chosen])

    @classmethod
    def joined(cls, parts: Sequence[Poses]) -> Poses:
        """Return poses one after the other."""
        return cls(
            np.concatenate([part.position for part in parts]),
            np.concatenate([part.orientation for part in parts]),
        )

    def take(self, indices: NDArray[np.intp]) -> Poses:
        """Return the poses at indices (m,), with each coordinate contiguous for `to_parent`."""
        return Poses(
            self.position.T.take(indices, axis=1).T, self.orientation.T.take(indices, axis=1).T
        )

    def turned(self, rotation: Array) -> Poses:
        """Return the poses of a frame that is turned in this one by a rotation (3, 3)."""
        w, x, y, z = mat2quat(rotation)
        return Poses(self.position, _product(self.orientation, np.array([x, y, z, w])))

    def to_parent(self, points: Array, origin: tuple[int, int, int] = (0, 0, 0)) -> Array:
        """Return points (n, 3) [m], one in the frame of each pose, in the parent frame.

        Coordinates there count from an origin [m].
        """
        moved = rotated(self.orientation, points)
        moved += self.position - origin
        return moved


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Samples of a frame's pose in the frame of odometry.

    Attributes
    ----------
    time_ns
        Stamps [ns], strictly ascending, shape (n,).
    poses
        Poses at these times; quaternions are normalised, with the sign nearer to the one before.
    mount
        Pose of the frame in that of the robot, whose odometry was recorded.

    Raises
    ------
    OdometryError
        If stamps do not ascend, a number is not finite or a quaternion's length is not 1 within
        LENGTH_TOLERANCE.
    """

    time_ns: Times
    poses: Poses
    mount: Pose = _UNMOUNTED
    _steps: Steps = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.time_ns)
        position, orientation = self.poses.position, self.poses.orientation
        if position.shape != (count, 3) or orientation.shape != (count, 4):
            raise OdometryError('odometry of unequal lengths', (position.shape, orientation.shape))
        if np.count_nonzero(self.time_ns[1:] <= self.time_ns[:-1]):
            raise OdometryError('odometry with stamps that do not ascend')
        if not (_is_finite(position) and _is_finite(orientation)):
            raise OdometryError('odometry that is not finite')
        poses = Poses(position, _continuous(_normalized(orientation)))
        object.__setattr__(self, 'poses', poses)
        object.__setattr__(self, '_steps', Steps(self.time_ns, position, poses.orientation))

    def mounted(self, mount: Pose) -> Odometry:
        """Return the odometry of a frame that is fixed to this one with a pose."""
        position = self.poses.to_parent(np.broadcast_to(mount.position, (len(self.time_ns), 3)))
        turned = self.poses.turned(mount.rotation)
        return Odometry(self.time_ns, Poses(position, turned.orientation), self.mount @ mount)

    def at(self, times_ns: Times, limits: OdometryConfig) -> Poses:
        """Return the poses at instants between samples, shape (n,); never extrapolated.

        Parameters
        ----------
        times_ns
            Instants [ns], ascending.
        limits
            Limits of the motion between these instants.

        Raises
        ------
        OdometryError
            If an instant is not between samples, or a motion exceeds the limits.
        """
        if not len(times_ns):
            return self.poses[:0]
        if len(self.time_ns) < 2:
            raise OdometryError('fewer than two odometry samples', len(self.time_ns))
        if self.time_ns[0] > times_ns[0]:
            raise OdometryError('no odometry before the first beam')
        if self.time_ns[-1] < times_ns[-1]:
            raise OdometryError('no odometry after the last beam')
        step = self._steps.of(times_ns)
        _check(self._steps.motion[:, step[0] : step[-1] + 1], limits)
        return Poses(*self._steps.at(times_ns, step))

    def jumps_ns(self, limits: OdometryConfig) -> Times:
        """Return when motions faster than a robot moves had ended [ns], ascending, shape (k,)."""
        _, speed, turn_rate = self._steps.motion
        jumps = (speed > limits.max_robot_speed) | (turn_rate > limits.max_robot_turn_rate)
        return np.compress(jumps, self.time_ns[1:])


def _check(motion: Array, limits: OdometryConfig) -> None:
    """Raise OdometryError if a motion (duration, speed, turn rate) exceeds the limits."""
    allowed = limits.max_odometry_gap, limits.max_robot_speed, limits.max_robot_turn_rate
    most = motion.max(axis=1).tolist()
    for value, limit, reason in zip(most, allowed, _OVER_LIMIT, strict=True):
        if value > limit:
            raise OdometryError(reason.format(limit), f'{value:.4g}')


def rotated(orientation: Array, vectors: Array) -> Array:
    """Return vectors (n, 3) turned by unit quaternions (n, 4): v + 2 (w (q x v) + q x (q x v))."""
    axis, w, v = orientation.T[:3], orientation.T[3], vectors.T
    across = _cross(axis, v)
    result = _cross(axis, across)
    across *= w
    result += across
    result *= 2.0
    result += v
    return result.T


def rotated_back(orientation: Array, vectors: Array) -> Array:
    """Return vectors (n, 3) turned back by unit quaternions (n, 4), or by a single one (1, 4)."""
    return rotated(orientation * (-1.0, -1.0, -1.0, 1.0), vectors)


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products of vectors (3, n); np.cross is several times slower."""
    (ax, ay, az), (bx, by, bz) = a, b
    result = np.empty_like(b)
    np.subtract(ay * bz, az * by, out=result[0])
    np.subtract(az * bx, ax * bz, out=result[1])
    np.subtract(ax * by, ay * bx, out=result[2])
    return result


def _product(a: Array, b: Array) -> Array:
    """Return the Hamilton products of quaternions (n, 4) and one (4,): b's rotation, then a's."""
    w = a[:, 3:] * b[3] - a[:, :3] @ b[:3, None]
    xyz = a[:, 3:] * b[:3] + b[3] * a[:, :3] + np.cross(a[:, :3], b[:3])
    return np.concatenate([xyz, w], axis=1)


def _is_finite(values: Array) -> bool:
    return np.count_nonzero(np.isfinite(values)) == values.size


def _normalized(orientation: Array) -> Array:
    length = lengths(orientation)
    wrong = np.abs(length - 1.0) >= LENGTH_TOLERANCE
    if np.count_nonzero(wrong):
        reason = f'odometry with a quaternion whose length is not 1 within {LENGTH_TOLERANCE:.3f}'
        raise OdometryError(reason, float(length[wrong][0]))
    return np.asarray(orientation / length[:, None])


def _continuous(orientation: Array) -> Array:
    """Return the quaternions with signs such that neighbours are in one hemisphere."""
    flips = dots(orientation[1:], orientation[:-1]) < 0.0
    if not np.count_nonzero(flips):
        return orientation
    signs = np.where(np.cumsum(flips) % 2, -1.0, 1.0)
    return np.concatenate([orientation[:1], orientation[1:] * signs[:, None]])
