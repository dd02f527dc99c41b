"""The beams of a scan: steps, azimuths and ranges."""

from dataclasses import dataclass
import math

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import DeviceError
from nodlidar_driver.scip.identity import Capabilities
import numpy as np
from numpy.typing import NDArray

_SPEEDS = 300, 6000  # rpm

_CODES = 20  # values below are not ranges [mm] but error codes
_NOTHING_IN_RANGE = (0, 6)


@dataclass(frozen=True, slots=True)
class ScanWindow:
    """The beams of a scan.

    With a cluster of c steps one value stands for c neighbouring beams: the shortest of their
    ranges. The lidar does not send which of them it was, so the value has the angle and the
    instant of the group's centre. That is off by at most (c - 1) / 2 steps, and by 0 on average.

    Attributes
    ----------
    first_step, last_step
        Steps, both included, a whole number of clusters.
    cluster
        Number of steps that share one value.
    skip
        Scans left out after each sent one.
    steps_per_revolution, front_step
        Layout of the lidar's steps; by default that of a URG-04LX.
    """

    first_step: int
    last_step: int
    cluster: int
    skip: int
    steps_per_revolution: int = 1024
    front_step: int = 384

    @property
    def count(self) -> int:
        """Number of values in a scan."""
        return (self.last_step - self.first_step + 1) // self.cluster

    @property
    def angle_min(self) -> float:
        """Azimuth of the first value [rad]."""
        return (self.first_beam - self.front_step) * math.tau / self.steps_per_revolution

    @property
    def angle_max(self) -> float:
        """Azimuth of the last value [rad]."""
        return self.angle_min + (self.count - 1) * self.angle_increment

    @property
    def angle_increment(self) -> float:
        """Angle between two values [rad]."""
        return math.tau / self.steps_per_revolution * self.cluster

    @property
    def first_beam(self) -> float:
        """Steps from step 0 to the centre of the first cluster."""
        return self.first_step + (self.cluster - 1) / 2.0


def scan_window(
    angle_min: float, angle_max: float, cluster: int, skip: int, lidar: Capabilities
) -> ScanWindow:
    """Return the window of the steps nearest to two azimuths [rad], of those that are measured.

    Steps that would make an incomplete cluster at the window's end are left out.

    Raises
    ------
    DeviceError
        If the lidar measures less than a cluster there, or turns too slowly or fast.
    """
    if not _SPEEDS[0] <= lidar.speed <= _SPEEDS[1]:
        allowed = f'{_SPEEDS[0]} to {_SPEEDS[1]} rpm'
        raise DeviceError(f'a lidar of {allowed} is supported, not of {lidar.speed} rpm')
    increment = math.tau / lidar.steps_per_revolution
    first_step = max(round(lidar.front_step + angle_min / increment), lidar.first_step)
    last_step = min(round(lidar.front_step + angle_max / increment), lidar.last_step)
    clusters = (last_step - first_step + 1) // cluster
    if clusters < 1:
        ends = (
            (step - lidar.front_step) * increment for step in (lidar.first_step, lidar.last_step)
        )
        raise DeviceError(
            'the lidar measures azimuths from {:.4f} to {:.4f} rad: '.format(*ends)
            + f'no {cluster} steps of {increment:.4f} rad of them are between '
            f'angle_min = {angle_min} and angle_max = {angle_max}'
        )
    return ScanWindow(
        first_step,
        first_step + clusters * cluster - 1,
        cluster,
        skip,
        lidar.steps_per_revolution,
        lidar.front_step,
    )


def ranges(codes: Integers, range_min_mm: int, range_max_mm: int) -> NDArray[np.float32]:
    """Convert the lidar's values [mm] to ranges [m] by REP 117, shape (n,).

    Too near is -inf, nothing in range (codes 0 and 6, or beyond range_max_mm) is +inf, and the
    other codes below 20 (weak, ambiguous or disturbed echoes) are NaN.
    """
    result = np.asarray(codes * 1e-3, dtype=np.float32)
    result[codes < range_min_mm] = -np.inf
    result[codes > range_max_mm] = np.inf
    errors = codes < _CODES
    result[errors] = _OF_CODE[codes[errors]]
    return result


_OF_CODE = np.full(_CODES, np.nan)
_OF_CODE[list(_NOTHING_IN_RANGE)] = np.inf
