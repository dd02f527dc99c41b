"""LaserScan messages, from rclpy or a bag, as scans."""

from functools import lru_cache
import math
from typing import Any

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import LATEST_NS, time_ns
import numpy as np


def scan_from_message(
    message: Any,
    delay_ns: int = 0,
    time_increment: float = 0.0,
    max_range: float = math.inf,
    last_beam_first: bool = False,
    range_offset: float = 0.0,
) -> Scan:
    """Return a LaserScan as a scan whose arrays are views of the message's, but for an offset.

    Parameters
    ----------
    message
        The LaserScan.
    delay_ns
        Delay of its stamp after the first beam [ns].
    time_increment
        Time between beams if the message has none [s].
    max_range
        Largest range that is a measurement, if below the message's range_max [m].
    last_beam_first
        Whether the lidar measured the last beam of the message first.
    range_offset
        Added to the ranges and their limits [m].

    Raises
    ------
    ParameterError
        If the message's stamp, angles, times or range limits are invalid.
    """
    stamp_ns = time_ns(message.header.stamp) - delay_ns
    if not 0 <= stamp_ns <= LATEST_NS:
        raise ParameterError('stamp', 'after 1970 and before 2038', stamp_ns / NS_PER_S)
    beams, angle, step = len(message.ranges), message.angle_min, message.angle_increment
    if last_beam_first:
        angle, step = angle + (beams - 1) * step, -step
    geometry = _geometry(
        beams,
        angle,
        step,
        message.time_increment or time_increment,
        max(message.range_min + range_offset, 0.0),
        min(message.range_max + range_offset, max_range),
    )
    order = slice(None, None, -1 if last_beam_first else 1)
    ranges = np.frombuffer(message.ranges, dtype=np.float32)[order]
    return Scan(
        stamp_ns=stamp_ns,
        geometry=geometry,
        ranges=ranges + np.float32(range_offset) if range_offset else ranges,
        intensities=np.frombuffer(message.intensities, dtype=np.float32)[order],
    )


# All scans of a lidar have the same geometry.
_geometry = lru_cache(maxsize=16)(ScanGeometry)
