"""Where the robot was at the instant of each beam, from odometry."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.errors import NodlidarError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.pose import Pose
import numpy as np
from numpy.typing import NDArray
from transforms3d.quaternions import mat2quat

Array = NDArray[np.float64]
Times = NDArray[np.int64]

# A quaternion may be 1e-3 longer or shorter than 1, as one that was rounded or integrated is. The
# rest is for lengths of 0.999 and 1.001, which are rounded.
LENGTH_TOLERANCE = 1e-3 + 1e-12


class OdometryError(NodlidarError):
    """Odometry from which the pose of a scan's beams cannot be told.

    Attributes
    ----------
    reason
        What is wrong, without the value: reasons are counted.
    """

    def __init__(self, reason: str, value: object = None) -> None:
        super().__init__(reason if value is None else f'{reason}: {value}')
        self.reason = reason


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What the motion between two odometry samples may be; more is a gap or a jump.

    Attributes
    ----------
    max_gap
        Longest time between samples that is interpolated over [s].
    max_speed, max_turn_rate
        Of the frame that odometry is of [m/s], [rad/s].
    """

    max_gap: float = 0.2
    max_speed: float = 5.0
    max_turn_rate: float = 10.0


USUAL_MOTION = MotionLimits()


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses of a frame in its parent frame.

    Attributes
    ----------
    position
        Of the origin [m], shape (n, 3).
    orientation
        Unit quaternions x, y, z, w, shape (n, 4).
    """

    position: Array
    orientation: Array

    def __getitem__(self, chosen: slice | NDArray[np.intp]) -> Poses:
        """Return some of the poses."""
        return Poses(self.position[chosen], self.orientation[chosen])

    def to_parent(self, points: Array) -> Array:
        """Return points (n, 3), each given in the frame at its own pose, in the parent frame."""
        return rotated(self.orientation, points) + self.position


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Samples of a frame's pose in the frame of odometry.

    Attributes
    ----------
    time_ns
        Stamps [ns], strictly ascending, shape (n,).
    poses
        The poses then; quaternions are normalised, and of q and -q taken the one nearer to the
        sample before.

    Raises
    ------
    OdometryError
        If stamps do not ascend, a number is not finite or a quaternion's length is not 1 within
        LENGTH_TOLERANCE.
    """

    time_ns: Times
    poses: Poses

    def __post_init__(self) -> None:
        count = len(self.time_ns)
        position, orientation = self.poses.position, self.poses.orientation
        if position.shape != (count, 3) or orientation.shape != (count, 4):
            raise OdometryError('odometry of unequal lengths', (position.shape, orientation.shape))
        if np.any(np.diff(self.time_ns) <= 0):
            raise OdometryError('odometry with stamps that do not ascend')
        if not (np.all(np.isfinite(position)) and np.all(np.isfinite(orientation))):
            raise OdometryError('odometry that is not finite')
        poses = Poses(position, _continuous(_normalized(orientation)))
        object.__setattr__(self, 'poses', poses)

    def mounted(self, mount: Pose) -> Odometry:
        """Return the odometry of a frame that is fixed in this one."""
        w, x, y, z = mat2quat(mount.rotation)
        turn = np.array([x, y, z, w])
        position = self.poses.to_parent(np.broadcast_to(mount.position, (len(self.time_ns), 3)))
        return Odometry(self.time_ns, Poses(position, _product(self.poses.orientation, turn)))

    def at(self, times_ns: Times, limits: MotionLimits) -> Poses:
        """Return the poses at instants [ns] between samples, shape (n,): never extrapolated.

        Positions move straight on between neighbouring samples, orientations turn evenly the
        shorter way (SLERP, Shoemake 1985).

        Raises
        ------
        OdometryError
            If an instant is not between samples, or a motion that is used exceeds the limits.
        """
        if not len(times_ns):
            return self.poses[:0]
        if len(self.time_ns) < 2:
            raise OdometryError('fewer than two odometry samples', len(self.time_ns))
        if self.time_ns[0] > np.min(times_ns):
            raise OdometryError('no odometry before the first beam')
        if self.time_ns[-1] < np.max(times_ns):
            raise OdometryError('no odometry after the last beam')
        before = np.searchsorted(self.time_ns, times_ns, side='right') - 1
        before = np.minimum(before, len(self.time_ns) - 2)
        self._check_motion(np.unique(before), limits)
        since, gap = (
            times_ns - self.time_ns[before],
            self.time_ns[before + 1] - self.time_ns[before],
        )
        return _between(self.poses[before], self.poses[before + 1], since / gap)

    def _check_motion(self, before: NDArray[np.intp], limits: MotionLimits) -> None:
        """Raise OdometryError if a motion from a sample to the next exceeds the limits."""
        here, there = self.poses[before], self.poses[before + 1]
        gap = (self.time_ns[before + 1] - self.time_ns[before]) / NS_PER_S
        speed = np.linalg.norm(there.position - here.position, axis=1) / gap
        turn_rate = 2.0 * _half_turn(here.orientation, there.orientation) / gap
        for values, limit, reason in (
            (gap, limits.max_gap, 'odometry more than {} s apart'),
            (speed, limits.max_speed, 'odometry jumps: it moves faster than {} m/s'),
            (turn_rate, limits.max_turn_rate, 'odometry jumps: it turns faster than {} rad/s'),
        ):
            if np.max(values) > limit:
                raise OdometryError(reason.format(limit), f'{np.max(values):.4g}')


def rotated(orientation: Array, vectors: Array) -> Array:
    """Return vectors (n, 3) turned by unit quaternions (n, 4): v + 2 w (q x v) + 2 q x (q x v)."""
    axis, w = orientation[:, :3].T, orientation[:, 3]
    v = vectors.T
    across = 2.0 * _cross(axis, v)
    return np.asarray((v + w * across + _cross(axis, across)).T)


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products of rows (3, n); np.cross is several times as slow."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _product(a: Array, b: Array) -> Array:
    """Return the Hamilton products of quaternions (n, 4) and one (4,): b's rotation, then a's."""
    w = a[:, 3:] * b[3] - a[:, :3] @ b[:3, None]
    xyz = a[:, 3:] * b[:3] + b[3] * a[:, :3] + np.cross(a[:, :3], b[:3])
    return np.concatenate([xyz, w], axis=1)


def _normalized(orientation: Array) -> Array:
    length = np.linalg.norm(orientation, axis=1, keepdims=True)
    wrong = np.abs(length - 1.0) > LENGTH_TOLERANCE
    if np.any(wrong):
        reason = f'odometry with a quaternion whose length is not 1 within {LENGTH_TOLERANCE:.3f}'
        raise OdometryError(reason, float(length[wrong][0]))
    return np.asarray(orientation / length)


def _continuous(orientation: Array) -> Array:
    """Return the quaternions with signs such that neighbours are on one hemisphere."""
    flips = np.sum(orientation[1:] * orientation[:-1], axis=1) < 0.0
    signs = np.where(np.cumsum(flips) % 2, -1.0, 1.0)
    return np.concatenate([orientation[:1], orientation[1:] * signs[:, None]])


def _half_turn(a: Array, b: Array) -> Array:
    """Return half of the turns from quaternions to others [rad], exact also near zero."""
    apart, along = np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1)
    return np.asarray(2.0 * np.arctan2(apart, along))


def _between(here: Poses, there: Poses, share: Array) -> Poses:
    """Return the poses at a share (n,) of the way, 0 .. 1.

    The weights of SLERP, sin((1 - u) h) / sin h and sin(u h) / sin h, are written by sinc: the
    half turn h is at most pi / 2, so that nothing is divided by zero.
    """
    half = _half_turn(here.orientation, there.orientation)[:, None] / np.pi
    to, of = share[:, None], 1.0 - share[:, None]
    whole = np.sinc(half)
    return Poses(
        of * here.position + to * there.position,
        of * np.sinc(of * half) / whole * here.orientation
        + to * np.sinc(to * half) / whole * there.orientation,
    )
