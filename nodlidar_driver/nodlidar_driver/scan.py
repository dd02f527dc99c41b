"""The beams of a scan: steps, azimuths and ranges."""

from dataclasses import dataclass
import math

from nodlidar_common.errors import DeviceError, ParameterError
from nodlidar_driver.identity import Capabilities
import numpy as np
from numpy.typing import NDArray

STEPS_PER_REVOLUTION = 1024
FRONT_STEP = 384
_INCREMENT = 2.0 * math.pi / STEPS_PER_REVOLUTION
_REVOLUTIONS = 0.05, 0.2  # s

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
    """

    first_step: int
    last_step: int
    cluster: int
    skip: int

    @property
    def count(self) -> int:
        """Number of values in a scan."""
        return (self.last_step - self.first_step + 1) // self.cluster

    @property
    def angle_min(self) -> float:
        """Azimuth of the first value [rad]."""
        return (self.first_beam - FRONT_STEP) * _INCREMENT

    @property
    def angle_max(self) -> float:
        """Azimuth of the last value [rad]."""
        return self.angle_min + (self.count - 1) * self.angle_increment

    @property
    def angle_increment(self) -> float:
        """Angle between two values [rad]."""
        return _INCREMENT * self.cluster

    @property
    def first_beam(self) -> float:
        """Steps from step 0 to the centre of the first cluster."""
        return self.first_step + (self.cluster - 1) / 2.0

    def check_measured_by(self, lidar: Capabilities) -> None:
        """Raise DeviceError if a lidar does not measure these beams or has another layout."""
        layout = (lidar.steps_per_revolution, lidar.front_step)
        if layout != (STEPS_PER_REVOLUTION, FRONT_STEP):
            raise DeviceError(
                f'a lidar with {STEPS_PER_REVOLUTION} steps per revolution and step {FRONT_STEP} '
                f'in front is supported, but this one ({lidar.model}) has {layout[0]} and '
                f'{layout[1]}'
            )
        if not _REVOLUTIONS[0] <= lidar.revolution <= _REVOLUTIONS[1]:
            raise DeviceError(f'a lidar of about 600 rpm is supported, not of {lidar.speed} rpm')
        if not lidar.first_step <= self.first_step <= self.last_step <= lidar.last_step:
            raise DeviceError(
                f'this lidar measures steps {lidar.first_step} to {lidar.last_step}, but '
                f'{self.first_step} to {self.last_step} are requested'
            )


def scan_window(angle_min: float, angle_max: float, cluster: int, skip: int) -> ScanWindow:
    """Return the window of the steps nearest to two azimuths [rad].

    Steps that would make an incomplete cluster at the window's end are left out.

    Raises
    ------
    ParameterError
        If the window is less than one cluster wide.
    """
    first_step = round(FRONT_STEP + angle_min / _INCREMENT)
    last_step = round(FRONT_STEP + angle_max / _INCREMENT)
    clusters = (last_step - first_step + 1) // cluster
    if clusters < 1:
        limit = f'at least {cluster} steps ({cluster * _INCREMENT:.4f} rad) above angle_min'
        raise ParameterError('angle_max', limit, angle_max)
    return ScanWindow(first_step, first_step + clusters * cluster - 1, cluster, skip)


def ranges(codes: NDArray[np.int64], range_min_mm: int, range_max_mm: int) -> NDArray[np.float32]:
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
