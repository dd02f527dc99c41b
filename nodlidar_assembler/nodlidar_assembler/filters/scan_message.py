"""LaserScan messages, rclpy's or those read from a bag, as the pipeline's values."""

from functools import lru_cache
from typing import Any

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_common.stamps import time_ns
import numpy as np


def geometry_from_message(message: Any) -> ScanGeometry:
    """Return what stays the same from one LaserScan to the next; raises ParameterError."""
    return _geometry(
        len(message.ranges),
        message.angle_min,
        message.angle_increment,
        message.time_increment,
        message.range_min,
        message.range_max,
    )


# A scan's is asked for several times on its way, and all scans of a lidar have the same.
_geometry = lru_cache(maxsize=16)(ScanGeometry)


def scan_from_message(message: Any) -> Scan:
    """Return a LaserScan as a scan whose arrays are views of the message's."""
    return Scan(
        stamp_ns=time_ns(message.header.stamp),
        geometry=geometry_from_message(message),
        ranges=np.frombuffer(message.ranges, dtype=np.float32),
        intensities=np.frombuffer(message.intensities, dtype=np.float32),
    )
