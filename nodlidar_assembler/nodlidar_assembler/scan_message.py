"""LaserScan messages, rclpy's or those read from a bag, as the pipeline's values."""

from typing import Any

from nodlidar_assembler.geometry import ScanGeometry
from nodlidar_assembler.pipeline import Scan
from nodlidar_common.stamps import time_ns
import numpy as np


def geometry_from_message(message: Any) -> ScanGeometry:
    """Return what stays the same from one LaserScan to the next; raises ParameterError."""
    return ScanGeometry(
        beams=len(message.ranges),
        angle_min=message.angle_min,
        angle_increment=message.angle_increment,
        time_increment=message.time_increment,
        range_min=message.range_min,
        range_max=message.range_max,
    )


def scan_from_message(message: Any) -> Scan:
    """Return a LaserScan as a scan whose arrays are views of the message's."""
    return Scan(
        stamp_ns=time_ns(message.header.stamp),
        geometry=geometry_from_message(message),
        ranges=np.frombuffer(message.ranges, dtype=np.float32),
        intensities=np.frombuffer(message.intensities, dtype=np.float32),
    )
