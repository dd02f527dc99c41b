"""The error sources of a scene, and their effect on ranges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.parameters import check, parameter
import numpy as np

Measure = Callable[[Integers, Array], Array]


@dataclass(frozen=True, slots=True)
class Effects:
    """The error sources of a scene; an effect is off, and costs nothing, at 0."""

    range_noise: float = parameter(
        0.0, 'Standard deviation of the noise on every range', unit='m', minimum=0.0, maximum=1.0
    )
    dropouts: float = parameter(
        0.0, 'Share of the beams that return no range', minimum=0.0, maximum=1.0
    )
    servo_jitter: float = parameter(
        0.0,
        'Of the ideal servo: its reversals are off by N(0, jitter); live, they are late by the '
        'absolute value of that',
        unit='s',
        minimum=0.0,
        maximum=0.1,
    )
    clock_drift: float = parameter(
        0.0,
        "Excess rate of the lidar's clock and revolutions; the driver follows no larger drift, "
        'ten times that of quartz',
        unit='ppm',
        minimum=-500.0,
        maximum=500.0,
    )
    odometry_error: float = parameter(
        0.0,
        'Standard deviation of the relative error of each of two wheels: position and heading '
        'drift with the distance driven',
        minimum=0.0,
        maximum=1.0,
    )
    wheel_slip: float = parameter(
        0.0,
        'Each wheel turns further than it rolls, by a share that is random for each odometry '
        'sample: the absolute value of N(0, slip)',
        minimum=0.0,
        maximum=1.0,
    )
    heading_drift: float = parameter(
        0.0,
        "Standard deviation of the drift rate of the odometry's heading, also at rest",
        unit='rad/s',
        minimum=0.0,
        maximum=1.0,
    )

    def __post_init__(self) -> None:
        check(self)

    @property
    def affect_odometry(self) -> bool:
        """Whether odometry has errors."""
        return max(self.odometry_error, self.wheel_slip, self.heading_drift) > 0.0

    @property
    def clock_rate(self) -> float:
        """Seconds of the lidar's clock in a second of the host."""
        return 1.0 + self.clock_drift * 1e-6


def imperfect(measure: Measure, effects: Effects, seed: int) -> Measure:
    """Return the measurement with effects, before rounding, of the true measurement `measure`.

    Both take (times [ns], azimuths [rad]) and return ranges [m], inf without a surface; NaN is a
    beam that dropped out. Without noise and drop-outs, returns `measure` itself.
    """
    faults = range_faults(effects, seed)
    return measure if faults is None else lambda times, azimuth: faults(measure(times, azimuth))


def range_faults(effects: Effects, seed: int) -> RangeFaults | None:
    """Return the errors of ranges, None if there are none."""
    any_fault = effects.range_noise > 0.0 or effects.dropouts > 0.0
    return RangeFaults(effects.range_noise, effects.dropouts, seed) if any_fault else None


class RangeFaults:
    """Adds normal noise [m] to ranges and drops a share of them; called in the order of beams."""

    def __init__(self, noise: float, dropouts: float, seed: int) -> None:
        self._noise, self._dropouts = noise, dropouts
        self._normal, self._uniform = np.random.default_rng(seed).spawn(2)

    def __call__(self, ranges: Array) -> Array:
        """Return the measured ranges [m], same shape; NaN for a drop-out."""
        if self._noise > 0.0:
            ranges = ranges + self._normal.normal(0.0, self._noise, ranges.shape)
        if self._dropouts > 0.0:
            ranges = np.where(self._uniform.random(ranges.shape) < self._dropouts, np.nan, ranges)
        return ranges
