"""Where the beams of a scan start and point, before the nod turns them."""

from dataclasses import dataclass, field
import math

from nodlidar_common.nod import NS_PER_S
from nodlidar_common.pose import Pose
import numpy as np
from numpy.typing import NDArray

# The laser's pose in the nodding frame on the reference sensor: z_off above the nod axis.
REFERENCE_MOUNT = Pose.from_xyzrpy((0.0, 0.0, 0.080, 0.0, 0.0, 0.0))


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
    geometry
        What the beams were computed from.
    mount
        Pose of the laser in the nodding frame.
    direction
        Unit vectors, shape (3, n): a range r ends at ``direction * r + mount.position``.
    offset
        Time of each beam after the first [s], shape (n,).
    offset_ns
        The same in whole nanoseconds.
    """

    geometry: ScanGeometry
    mount: Pose
    direction: NDArray[np.float64] = field(init=False)
    offset: NDArray[np.float64] = field(init=False)
    offset_ns: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        index = np.arange(self.geometry.beams)
        azimuth = self.geometry.angle_min + self.geometry.angle_increment * index
        in_laser = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)])
        offset = self.geometry.time_increment * index
        object.__setattr__(self, 'direction', self.mount.rotation @ in_laser)
        object.__setattr__(self, 'offset', offset)
        object.__setattr__(self, 'offset_ns', np.rint(offset * NS_PER_S).astype(np.int64))

    @property
    def duration_ns(self) -> int:
        """Time from the first to the last beam [ns]."""
        return int(self.offset_ns[-1]) if self.geometry.beams else 0


def revolution_time(geometry: ScanGeometry) -> float:
    """Return the time of one whole revolution of the lidar [s], dark part included."""
    return geometry.time_increment * 2.0 * math.pi / geometry.angle_increment
