"""Stamps of odometry that jitter, as those of arrival over a network or at a busy computer.

The robot then seems to speed up and to brake from sample to sample, and would not if the samples
were evenly spaced. Samples that truly are uneven, or lost, would make it leap if they were.
"""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Odometry, rotated
from nodlidar_assembler.plausibility.point_error import DISTANCE, LEAST_ERROR
from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np

WINDOW_NS = 10 * NS_PER_S  # over which it is judged
FEWEST_SAMPLES = 20
SMOOTHER = 0.5  # share of the squared offsets that remains if samples are even, at most


@dataclass(frozen=True, slots=True)
class OdometryJitter:
    """How far stamps are off even ones.

    Attributes
    ----------
    seconds
        RMS [s].
    period
        Of the samples [s].
    error
        By how much points at DISTANCE are off, RMS [m].
    """

    seconds: float
    period: float
    error: float

    @classmethod
    def of(cls, times_ns: Times, position: Array, ends: Array) -> OdometryJitter | None:
        """Return the jitter of samples: stamps [ns], poses as in `offsets`; None if it is small.

        It is small if points are off by LEAST_ERROR or less.
        """
        index = np.arange(len(times_ns))
        since = (times_ns - times_ns[0]) / NS_PER_S
        period = float(since[-1]) / index[-1]
        even_ns = np.rint(index * period * NS_PER_S).astype(np.int64)
        stamped, even = (
            sum(float(np.sum(off**2)) for off in offsets(each_ns, position, ends)[:2])
            for each_ns in (times_ns, even_ns)
        )
        if even > SMOOTHER * stamped:
            return None
        seconds = float(np.std(since - np.polyval(np.polyfit(index, since, 1), index)))
        steps = sum(float(np.sum(np.diff(each, axis=0) ** 2)) for each in (position, ends))
        error = seconds / period * float(steps / index[-1]) ** 0.5
        return cls(seconds, period, error) if error > LEAST_ERROR else None

    @classmethod
    def worst(cls, odometry: Odometry) -> OdometryJitter | None:
        """Return the worst of the windows of a drive, by the error of points; None without any."""
        times_ns, position = odometry.time_ns, odometry.poses.position
        ends = ends_of(odometry.poses.orientation)
        number = (times_ns - times_ns[0]) // WINDOW_NS  # of the window of each sample
        windows = np.split(np.arange(len(number)), np.flatnonzero(np.diff(number)) + 1)
        found = [
            jitter
            for each in windows
            if len(each) >= FEWEST_SAMPLES
            and (jitter := cls.of(times_ns[each], position[each], ends[each])) is not None
        ]
        return max(found, key=lambda each: each.error, default=None)

    def __str__(self) -> str:
        return (
            f'{self.seconds * 1e3:.0f} ms RMS, so points {DISTANCE:g} m away are '
            f'{self.error * 1e3:.0f} mm off; stamp each pose when it is measured, or set '
            f'odometry_period to {self.period:.4f} in assembler and mapper'
        )


def ends_of(orientation: Array) -> Array:
    """Return orientations (n, 4) as coordinates [m], (n, 9), whose distances are of points.

    Points are DISTANCE away, in all directions.
    """
    axes = DISTANCE / 3.0**0.5 * np.eye(3)
    unit = orientation / np.linalg.norm(orientation, axis=1, keepdims=True)
    count = len(orientation)
    return np.concatenate([rotated(unit, np.tile(axis, (count, 1))) for axis in axes], axis=1)


def offsets(times_ns: Times, position: Array, ends: Array) -> tuple[Array, Array, Array]:
    """Return how far poses are off the straight way between their neighbours.

    Returns
    -------
    of_position, of_ends
        Offsets [m], shape (n - 2, 3) and (n - 2, 9).
    half_square
        Offset by an acceleration of 1 m/s^2 [m], shape (n - 2,).
    """
    gap = np.diff(times_ns) / NS_PER_S
    before, after = gap[:-1, None], gap[1:, None]
    whole = before + after
    of_position, of_ends = (
        each[1:-1] - (after * each[:-2] + before * each[2:]) / whole for each in (position, ends)
    )
    return of_position, of_ends, 0.5 * (before * after)[:, 0]
