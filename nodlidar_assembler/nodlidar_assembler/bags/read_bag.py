"""Reads a whole bag into arrays, without ROS."""

from pathlib import Path

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.bags.bag_tf import BagTf
from nodlidar_assembler.bags.bag_types import BagError, JOINT_STATE, SCAN, TF
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.pitch import ordered_samples
from nodlidar_assembler.inputs.scan_message import scan_from_message
from nodlidar_common.stamps import time_ns
import numpy as np


def read_bag(path: Path, joint_name: str) -> SensorLog:
    """Return the scans and the samples of one joint in a ROS 2 bag.

    Raises
    ------
    BagError
        If the bag has no scans or no positions of that joint, or cannot be read to its end.
    """
    scans: list[Scan] = []
    samples: list[tuple[int, float]] = []
    for recorded in messages_of(path, lambda topic, kind: kind in (SCAN, JOINT_STATE)):
        message = recorded.message
        if recorded.msgtype == SCAN:
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


def read_odometry(path: Path, odom_frame: str, frame: str) -> Odometry:
    """Return a frame's odometry: the transforms from odom_frame to the frame's carrier.

    Of equal stamps the last one counts.

    Raises
    ------
    BagError
        If there are none (a chain of moving ones is not combined), a fixed one is not a pose, or
        the bag cannot be read to its end.
    OdometryError
        If they are not poses.
    """
    static, moving, again = (
        (recorded.message for recorded in messages_of(path, is_wanted))
        for is_wanted in (_is_static, _is_moving, _is_moving)
    )
    tf = BagTf(odom_frame, frame, static, moving)
    samples = {pose[0]: (*pose[1], *pose[2]) for message in again for pose in tf.samples(message)}
    if not samples:
        raise BagError(f"'{path}' has {tf.missing_input}")
    stamps = sorted(samples)
    poses = np.array([samples[stamp] for stamp in stamps])
    odometry = Odometry(np.array(stamps, dtype=np.int64), Poses(poses[:, :3], poses[:, 3:]))
    return odometry.mounted(tf.mount)


def _is_static(topic: str, kind: str) -> bool:
    return kind == TF and topic.endswith('tf_static')


def _is_moving(topic: str, kind: str) -> bool:
    return kind == TF and not topic.endswith('tf_static')
