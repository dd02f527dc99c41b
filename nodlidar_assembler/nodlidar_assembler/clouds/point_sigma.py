"""The expected error of each point: the field sigma of a cloud."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.geometry import Beams
from nodlidar_common.arrays import Array
from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray

# Beams on either side over which the speed of the nod is taken: an eighth of the scan, as the
# pitch by `nearest` is a staircase.
_REACH = 8


@dataclass(frozen=True)
class SigmaConfig:
    """Expected error of each point."""

    sigma_field: bool = parameter(
        False, 'Add the field sigma to clouds: the expected 1-sigma error of each point in m'
    )
    sigma_range: float = parameter(
        0.0078,
        'Standard deviation of a range close by, noise and bias; default of a URG-04LX-UG01',
        unit='m',
        minimum=0.0,
        maximum=1.0,
    )
    sigma_range_growth: float = parameter(
        0.004, 'Standard deviation of a far range, per metre', minimum=0.0, maximum=0.5
    )
    sigma_pitch: float = parameter(
        0.0047,
        'Standard deviation of the pitch of the lidar, backlash and encoder included; default of '
        'slerp on an RX-24F',
        unit='rad',
        minimum=0.0,
        maximum=1.0,
    )
    sigma_time: float = parameter(
        0.0007,
        'Standard deviation of the delay between scans and joint states',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )

    def range_variance(self, ranges: Array) -> Array:
        """Return the variance of ranges [m^2], shape (n,)."""
        return self.sigma_range**2 + (self.sigma_range_growth * ranges) ** 2


def point_sigma(
    config: SigmaConfig,
    ranges: NDArray[np.float32],
    xyz: Array,
    speed: Array,
) -> Array:
    """Return the expected RMS displacement [m] of points from their true places, shape (n,).

    The first-order propagation of `nodlidar_planner.error_budget`, at the speed of the nod at
    each beam rather than its mean: an error of the range moves a point by as much, one of the
    pitch by its distance from the nod axis, a delay by that times the speed.

    Parameters
    ----------
    config
        Standard deviations.
    ranges
        Ranges [m], shape (n,).
    xyz
        Points in nodlidar_base_link [m], whose y axis is the nod axis, shape (3, n).
    speed
        Speed of the nod [rad/s], shape (n,).
    """
    from_axis = xyz[0] ** 2 + xyz[2] ** 2
    angle = config.sigma_pitch**2 + (config.sigma_time * speed) ** 2
    of_range = config.range_variance(ranges.astype(float))
    return np.asarray(np.sqrt(of_range + from_axis * angle))


def nod_speed(beams: Beams, pitch: Array) -> Array:
    """Return the speed of the nod [rad/s] at each beam, by differences of pitches, shape (n,).

    It is 0 for beams that share one instant.
    """
    last = len(pitch) - 1
    index = np.arange(len(pitch))
    reach = last // _REACH + 1
    before, after = np.maximum(index - reach, 0), np.minimum(index + reach, last)
    duration = beams.offset[after] - beams.offset[before]
    turned = pitch[after] - pitch[before]
    return np.divide(turned, duration, out=np.zeros(len(pitch)), where=duration > 0.0)
