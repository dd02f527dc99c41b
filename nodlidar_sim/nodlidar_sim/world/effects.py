"""What goes wrong in a scene, and what that does to its ranges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Measure = Callable[[NDArray[np.int64], Array], Array]


@dataclass(frozen=True, slots=True)
class Effects:
    """What goes wrong in a scene; every effect is off at 0, and then nothing is made for it."""

    range_noise: float = parameter(
        0.0, 'Standard deviation of the ranges', unit='m', minimum=0.0, maximum=1.0
    )
    dropouts: float = parameter(
        0.0, 'Share of the beams that come back without a range', minimum=0.0, maximum=1.0
    )
    servo_jitter: float = parameter(
        0.0, 'Standard deviation of the reversal instants', unit='s', minimum=0.0, maximum=0.1
    )
    clock_drift: float = parameter(
        0.0,
        'Excess rate of the lidar clock; the driver follows 500 ppm, ten times that of quartz',
        unit='ppm',
        minimum=-500.0,
        maximum=500.0,
    )
    odometry_error: float = parameter(
        0.0,
        'Standard deviation of the share by which each wheel miscounts',
        minimum=0.0,
        maximum=1.0,
    )
    wheel_slip: float = parameter(
        0.0,
        'Typical share (that of a standard deviation) by which each wheel turns too far, slipping',
        minimum=0.0,
        maximum=1.0,
    )
    heading_drift: float = parameter(
        0.0,
        'Standard deviation of the rate at which the heading of the odometry drifts',
        unit='rad/s',
        minimum=0.0,
        maximum=1.0,
    )

    @property
    def spoil_odometry(self) -> bool:
        """Whether odometry is anything but exact."""
        return max(self.odometry_error, self.wheel_slip, self.heading_drift) > 0.0

    @property
    def clock_rate(self) -> float:
        """Seconds of the lidar's clock in a second of the host."""
        return 1.0 + self.clock_drift * 1e-6


def imperfect(measure: Measure, effects: Effects, seed: int) -> Measure:
    """Return what the lidar measures where `measure` is the truth, before it rounds.

    Both take (times [ns], azimuths [rad]) and return ranges [m], inf where there is nothing; NaN
    is a beam that dropped out. Without noise and drop-outs it is `measure` itself.
    """
    faults = range_faults(effects, seed)
    return measure if faults is None else lambda times, azimuth: faults(measure(times, azimuth))


def range_faults(effects: Effects, seed: int) -> RangeFaults | None:
    """Return what spoils true ranges, or None if nothing does."""
    spoilt = effects.range_noise > 0.0 or effects.dropouts > 0.0
    return RangeFaults(effects.range_noise, effects.dropouts, seed) if spoilt else None


class RangeFaults:
    """Adds normal noise [m] to ranges and drops a share of them, in the order of the beams."""

    def __init__(self, noise: float, dropouts: float, seed: int) -> None:
        self._noise, self._dropouts = noise, dropouts
        self._rng = np.random.default_rng(seed)

    def __call__(self, ranges: Array) -> Array:
        """Return the ranges [m] as measured, same shape; NaN for a drop-out."""
        if self._noise > 0.0:
            ranges = ranges + self._rng.normal(0.0, self._noise, ranges.shape)
        if self._dropouts > 0.0:
            ranges = np.where(self._rng.random(ranges.shape) < self._dropouts, np.nan, ranges)
        return ranges
