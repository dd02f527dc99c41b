"""Scans as ROS messages."""

import array

from nodlidar_common.ros.messages import time_message
from nodlidar_driver.scip.identity import Capabilities
from nodlidar_driver.scip.scan_window import ScanWindow
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import LaserScan, TimeReference


def scan_template(window: ScanWindow, frame_id: str, lidar: Capabilities) -> LaserScan:
    """Return a scan with the fields that all scans share."""
    message = LaserScan(
        angle_min=window.angle_min,
        angle_max=window.angle_max,
        angle_increment=window.angle_increment,
        range_min=lidar.range_min,
        range_max=lidar.range_max,
    )
    message.header.frame_id = frame_id
    return message


def fill_scan(
    message: LaserScan,
    window: ScanWindow,
    stamp_ns: int,
    revolution: float,
    ranges: NDArray[np.float32],
) -> None:
    """Fill in the time of the first beam [ns], that of a revolution [s], the ranges [m], (n,)."""
    message.header.stamp = time_message(stamp_ns)
    message.time_increment = revolution / window.steps_per_revolution * window.cluster
    message.scan_time = revolution * (window.skip + 1)
    message.ranges = array.array('f', ranges.tobytes())


def arrival_message(message: LaserScan, arrival_ns: int) -> TimeReference:
    """Return the message that a scan's last byte was read at a time [ns]."""
    arrival = TimeReference(time_ref=message.header.stamp, source='last byte')
    arrival.header.stamp = time_message(arrival_ns)
    arrival.header.frame_id = message.header.frame_id
    return arrival
