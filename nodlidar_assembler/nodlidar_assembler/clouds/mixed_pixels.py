"""Mixed pixels: ranges between two surfaces, where the spot of a beam covers an edge."""

from dataclasses import dataclass
import math
from typing import Any

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_common.arrays import Mask
from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class MixedPixelConfig:
    """Mixed pixels."""

    mixed_pixel_angle: float = parameter(
        0.2,
        'A point is taken for a mixed pixel and removed if the line to a nearer neighbour in the '
        'scan is within this angle of the beam, and the point is not on the line of those before '
        'that neighbour; 0 keeps all',
        unit='rad',
        minimum=0.0,
        maximum=1.5,
    )
    mixed_pixel_step: float = parameter(
        0.05,
        'Least difference of range between such neighbours, above the noise of the lidar',
        unit='m',
        minimum=0.0,
        maximum=10.0,
    )


def find_mixed_pixels(
    ranges: NDArray[np.float32], geometry: ScanGeometry, config: MixedPixelConfig
) -> Mask:
    """Return which beams of a scan are mixed pixels, or just behind an edge, shape (n,).

    Neighbours at the ranges n < f, an angle d apart, are connected within the angle a of the beam
    if f > n (cos d + sin d / tan a). As the shadow filter of laser_filters, this removes the
    farther of the two: it is the mixed pixel, or the first beam that passes the edge. The nearer
    one is on the object. A beam that is where the line of those before it leads is kept: it is on
    a wall that is seen at such a low angle.

    Parameters
    ----------
    ranges
        As in the LaserScan [m], shape (n,). A beam without a measurement is no neighbour.
    geometry
        Of the scan.
    config
        `mixed_pixel_angle` above 0.
    """
    apart = abs(geometry.angle_increment)
    ratio = math.cos(apart) + math.sin(apart) / math.tan(config.mixed_pixel_angle)
    known = np.where(geometry.measured(ranges), ranges, np.nan)
    limit = np.maximum(known * ratio, known + config.mixed_pixel_step)
    after = np.flatnonzero(known[1:] > limit[:-1]) + 1
    before = np.flatnonzero(known[:-1] > limit[1:])
    beam = np.concatenate([after, before])
    side = np.repeat([-1, 1], [len(after), len(before)])
    found = np.zeros(len(ranges), dtype=np.bool_)
    found[beam[~_continues(known, beam, side, apart)]] = True
    return found


def _continues(
    known: NDArray[np.floating[Any]],
    beam: NDArray[np.intp],
    side: NDArray[np.intp],
    apart: float,
) -> Mask:
    """Return which beams continue the line of the three on one side of each (-1, 1), shape (m,).

    On a line, 1 / r(i) + 1 / r(i - 2) = 2 cos d / r(i - 1). A beam is on it if that is right to a
    quarter of its step from the one before, and so for the beam before.
    """
    ends = np.full(3, np.nan)
    chain = np.concatenate([ends, known, ends])[3 + beam + side * np.arange(4)[:, None]]
    with np.errstate(divide='ignore'):
        line = 1.0 / (2.0 * math.cos(apart) / chain[1:3] - 1.0 / chain[2:])
    straight = np.abs(chain[:2] - line) < (chain[:2] - chain[1:3]) / 4.0
    return np.asarray(straight[0] & straight[1])
