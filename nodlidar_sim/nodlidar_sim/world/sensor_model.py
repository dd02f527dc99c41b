"""The specifications of lidar and servo in the fast mode: timing and resolution."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Any

from nodlidar_common.arrays import Array, Times
from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, parameter
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SensorModel:
    """The two devices; by default a Hokuyo URG-04LX-UG01 on a Dynamixel RX-24F."""

    steps: int = parameter(1024, 'Steps of a revolution', minimum=1)
    first_step: int = parameter(44, 'First step that is measured', minimum=0)
    last_step: int = parameter(725, 'Last step that is measured', minimum=0)
    front_step: int = parameter(384, 'Step straight ahead', minimum=0)
    scan_time: float = parameter(0.1, 'Time of a revolution', unit='s', minimum=1e-3)
    range_min: float = parameter(0.02, 'Least range', unit='m', minimum=0.0)
    range_max: float = parameter(5.6, 'Greatest range', unit='m', minimum=0.0)
    resolution: float = parameter(1e-3, 'Step of the ranges', unit='m', minimum=1e-6)
    joint_rate: float = parameter(62.0, 'Position readings in a second', unit='Hz', minimum=1.0)
    joint_latency: float = parameter(
        0.015,
        "Time that a servo's reading takes to the host; 62 Hz is due to 16 ms of the adapter",
        unit='s',
        minimum=0.0,
        maximum=0.1,
    )
    joint_tick: float = parameter(
        math.radians(300.0) / 1024.0, 'Step of the position', unit='rad', minimum=1e-9
    )
    acceleration: float = parameter(
        REVERSAL_ACCELERATION, 'Of the reversals', unit='rad/s^2', minimum=1e-3
    )
    odometry_rate: float = parameter(50.0, 'Odometry samples in a second', unit='Hz', minimum=1.0)

    def __post_init__(self) -> None:
        check(self)
        if not self.first_step <= self.last_step < self.steps:
            limit = f'from first_step = {self.first_step} to below steps = {self.steps}'
            raise ParameterError('last_step', limit, self.last_step)

    @property
    def azimuth(self) -> Array:
        """Angle of each measured beam in the scan plane [rad], shape (b,)."""
        return np.asarray((self._measured - self.front_step) * self.angle_increment)

    @property
    def angle_increment(self) -> float:
        """Angle from a beam to the next [rad]."""
        return math.tau / self.steps

    @property
    def time_increment(self) -> float:
        """Time T_s from a beam to the next, by the lidar's clock [s]."""
        return self.scan_time / self.steps

    def beam_times_ns(self, start_ns: int, scans: int, clock_rate: float) -> Times:
        """Return the times of beams [ns], shape (scans, b), with the first step 0 at start_ns."""
        samples = np.arange(scans)[:, None] * self.steps + self._measured
        return instants(start_ns, samples * (self.time_increment / clock_rate))

    def rounded_ranges(self, ranges: Array) -> Array:
        """Return ranges [m] of any shape as reported; -inf too near, inf too far (REP 117)."""
        per_metre = 1.0 / self.resolution  # 5600 / 1000 is exactly 5.6, 5600 * 1e-3 is not
        rounded = np.asarray(np.rint(ranges * per_metre) / per_metre)
        rounded[rounded < self.range_min] = -np.inf
        rounded[rounded > self.range_max] = np.inf
        return rounded

    @property
    def _measured(self) -> Times:
        return np.arange(self.first_step, self.last_step + 1)


def instants(start_ns: int, elapsed: NDArray[np.floating[Any]]) -> Times:
    """Return the instants [ns] at times [s] after a start, of any shape."""
    return np.asarray(start_ns + np.rint(elapsed * NS_PER_S).astype(np.int64))
