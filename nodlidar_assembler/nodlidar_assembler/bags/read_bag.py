"""Reads a bag into a log, without ROS."""

from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_types import BagError, JOINT_STATE, SCAN, STORE
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.pitch import ordered_samples
from nodlidar_assembler.filters.scan_message import scan_from_message
from nodlidar_common.stamps import time_ns
import numpy as np
from rosbags.highlevel import AnyReader


def read_bag(path: Path, joint_name: str) -> SensorLog:
    """Return the scans and the samples of one joint in a ROS 2 bag.

    Raises
    ------
    BagError
        If the bag has no scans or no positions of that joint.
    """
    scans: list[Scan] = []
    samples: list[tuple[int, float]] = []
    with AnyReader([path], default_typestore=STORE) as reader:
        wanted = [c for c in reader.connections if c.msgtype in (SCAN, JOINT_STATE)]
        for connection, _, raw in reader.messages(connections=wanted):
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype == SCAN:
                scans.append(scan_from_message(message))
            elif joint_name in message.name:
                position = message.position[message.name.index(joint_name)]
                samples.append((time_ns(message.header.stamp), float(position)))
    if not scans:
        raise BagError(f"'{path}' has no scans")
    if not samples:
        raise BagError(f"'{path}' has no positions of the joint '{joint_name}'")
    stamps, positions = zip(*samples, strict=True)
    ordered = ordered_samples(np.array(stamps, dtype=np.int64), np.array(positions))
    return SensorLog(sorted(scans, key=lambda scan: scan.stamp_ns), *ordered)
