"""Where the beams of a scan start and point, before the nod turns them."""

from dataclasses import dataclass, field
import math

from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray
from transforms3d.euler import euler2mat


@dataclass(frozen=True, slots=True)
class Mount:
    """The pose of the laser's optical centre in the nodding frame (REP 103 axes).

    Attributes
    ----------
    xyz
        Optical centre [m]; on the reference sensor 0.080 m above the nod axis.
    rpy
        Fixed-axis roll, pitch, yaw [rad], as in URDF.
    """

    xyz: tuple[float, float, float] = (0.0, 0.0, 0.080)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def rotation(self) -> NDArray[np.float64]:
        """Return the rotation from the laser to the nodding frame, shape (3, 3)."""
        return np.asarray(euler2mat(*self.rpy, axes='sxyz'), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class ScanGeometry:
    """The part of a LaserScan that does not change from one scan to the next.

    Attributes
    ----------
    beams
        Number of beams in a scan.
    angle_min, angle_increment
        Azimuth of the first beam and step between beams [rad].
    time_increment
        Time between beams [s].
    range_min, range_max
        Nearest and farthest range that is a measurement [m].
    """

    beams: int
    angle_min: float
    angle_increment: float
    time_increment: float
    range_min: float
    range_max: float


@dataclass(frozen=True, slots=True)
class Beams:
    """The beams of a scan in the nodding frame, computed once for all scans of one geometry.

    Attributes
    ----------
    geometry, mount
        What the beams were computed from.
    direction
        Unit vectors, shape (3, n): a range r ends at ``direction * r + mount.xyz``.
    offset
        Time of each beam after the first [s], shape (n,).
    offset_ns
        The same in whole nanoseconds.
    """

    geometry: ScanGeometry
    mount: Mount
    direction: NDArray[np.float64] = field(init=False)
    offset: NDArray[np.float64] = field(init=False)
    offset_ns: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        index = np.arange(self.geometry.beams)
        azimuth = self.geometry.angle_min + self.geometry.angle_increment * index
        in_laser = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)])
        offset = self.geometry.time_increment * index
        object.__setattr__(self, 'direction', self.mount.rotation() @ in_laser)
        object.__setattr__(self, 'offset', offset)
        object.__setattr__(self, 'offset_ns', np.rint(offset * NS_PER_S).astype(np.int64))

    @property
    def duration_ns(self) -> int:
        """Time from the first to the last beam [ns]."""
        return int(self.offset_ns[-1]) if self.geometry.beams else 0


def revolution_time(geometry: ScanGeometry) -> float:
    """Return the time of one whole revolution of the lidar [s], dark part included."""
    return geometry.time_increment * 2.0 * math.pi / geometry.angle_increment
