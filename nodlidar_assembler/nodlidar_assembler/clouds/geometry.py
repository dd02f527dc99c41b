"""Origin, direction and time of the beams of a scan in the nodding frame."""

from dataclasses import dataclass, field
import math

from nodlidar_common.arrays import Array, Mask, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

# Least step between beams [rad]: a thousandth of the finest scanners' step.
_LEAST_STEP = 1e-6
# A message with beams of more revolutions is not one scan.
_MOST_REVOLUTIONS = 2.0
# Shortest and longest revolution of any lidar [s].
_SHORTEST, _LONGEST = 5e-4, 20.0
# Largest range [m]: range_max may be infinite, but points are finite.
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class LaserPoseConfig:
    """Mounting of the lidar."""

    laser_xyz: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.080),
        'Optical centre of the lidar in the nodding frame',
        unit='m',
        minimum=-10.0,
        maximum=10.0,
    )
    laser_rpy: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0),
        'Roll, pitch and yaw of the lidar in the nodding frame; a positive pitch turns beams down',
        unit='rad',
        minimum=-6.2832,
        maximum=6.2832,
    )
    beam_elevation: float = parameter(
        0.0,
        'Angle at which the beams rise out of the plane in which the lidar turns',
        unit='rad',
        minimum=-0.2,
        maximum=0.2,
    )

    def check_together(self) -> None:
        """Raise ParameterError if a vector has not three components."""
        for key in ('laser_xyz', 'laser_rpy'):
            if len(getattr(self, key)) != 3:
                raise ParameterError(key, 'three numbers', getattr(self, key))

    @property
    def laser_pose(self) -> Pose:
        """Pose of the laser in the nodding frame."""
        return Pose.from_xyzrpy((*self.laser_xyz, *self.laser_rpy))


REFERENCE_LASER_POSE = LaserPoseConfig().laser_pose


@dataclass(frozen=True, slots=True)
class ScanGeometry:
    """The fields of a LaserScan that are equal for all scans of a lidar.

    Attributes
    ----------
    beams
        Number of beams.
    angle_min, angle_increment
        Azimuth of the first beam and step between beams [rad].
    time_increment
        Time between beams [s].
    range_min, range_max
        Shortest and longest valid range [m].

    Raises
    ------
    ParameterError
        If there are no beams, or their angles, times or range limits are invalid.
    """

    beams: int
    angle_min: float
    angle_increment: float
    time_increment: float
    range_min: float
    range_max: float

    def __post_init__(self) -> None:
        if self.beams < 1:
            raise ParameterError('ranges', 'of at least one beam', self.beams)
        if not abs(self.angle_min) <= 4.0 * math.pi:
            raise ParameterError('angle_min', 'between -4 pi and 4 pi rad', self.angle_min)
        if not _LEAST_STEP <= abs(self.angle_increment) <= 2.0 * math.pi:
            limit = f'between {_LEAST_STEP} and 2 pi rad, or the negative of that'
            raise ParameterError('angle_increment', limit, self.angle_increment)
        if self.beams * abs(self.angle_increment) > _MOST_REVOLUTIONS * math.tau * 1.01:
            limit = f'at most {_MOST_REVOLUTIONS:g} revolutions of beams'
            raise ParameterError('ranges', limit, self.beams)
        self._check_rate()
        if not 0.0 <= self.range_min < math.inf:
            raise ParameterError('range_min', 'at least 0 m and finite', self.range_min)
        if not self.range_min <= self.range_max:
            raise ParameterError('range_max', 'at least range_min', self.range_max)

    def measured(self, ranges: NDArray[np.float32]) -> Mask:
        """Return which ranges [m] are measurements, by REP 117, shape (n,)."""
        return (ranges >= self.range_min) & (ranges <= min(self.range_max, _LARGEST))

    def _check_rate(self) -> None:
        if not 0.0 <= self.time_increment <= 1.0:
            raise ParameterError('time_increment', 'between 0 and 1 s', self.time_increment)
        if self.time_increment and not _SHORTEST <= revolution_time(self) <= _LONGEST:
            limit = f'0, or such that a revolution takes {_SHORTEST} to {_LONGEST:g} s'
            raise ParameterError('time_increment', limit, self.time_increment)


@dataclass(frozen=True, slots=True)
class Beams:
    """The beams of a scan in the nodding frame, computed once for all scans of one geometry.

    Attributes
    ----------
    geometry
        Geometry of the scans.
    laser_pose
        Pose of the laser in the nodding frame.
    elevation
        Angle at which the beams rise out of the xy plane of the laser's frame [rad].
    azimuth
        Azimuth of each beam in the laser's frame [rad], shape (n,).
    direction
        Unit vectors, shape (3, n): range r ends at ``direction * r + laser_pose.position``.
    offset
        Time of each beam after the first [s], shape (n,).
    offset_ns
        The same, rounded [ns].
    """

    geometry: ScanGeometry
    laser_pose: Pose
    elevation: float = 0.0
    azimuth: Array = field(init=False)
    direction: Array = field(init=False)
    offset: Array = field(init=False)
    offset_ns: Times = field(init=False)

    def __post_init__(self) -> None:
        index = np.arange(self.geometry.beams)
        azimuth = self.geometry.angle_min + self.geometry.angle_increment * index
        in_laser = directions(azimuth, self.elevation)
        offset = self.geometry.time_increment * index
        object.__setattr__(self, 'azimuth', azimuth)
        object.__setattr__(self, 'direction', self.laser_pose.rotation @ in_laser)
        object.__setattr__(self, 'offset', offset)
        object.__setattr__(self, 'offset_ns', np.rint(offset * NS_PER_S).astype(np.int64))


def directions(azimuth: Array, elevation: float) -> Array:
    """Return unit vectors (3, n) at azimuths (n,) that rise out of the xy plane by an angle."""
    level = math.cos(elevation)
    rise = np.full_like(azimuth, math.sin(elevation))
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), rise])


def revolution_time(geometry: ScanGeometry) -> float:
    """Return the time of one revolution of the lidar [s], dark steps included."""
    return geometry.time_increment * 2.0 * math.pi / abs(geometry.angle_increment)
