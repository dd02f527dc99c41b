"""Reads a whole bag into arrays, without ROS."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_tf import tf_in
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.pitch import ordered_samples
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_common.bag_messages import SCAN, TF
from nodlidar_common.stamps import NS_PER_S
import numpy as np

USUAL_TOPICS = Topics()


class LogGatherer:
    """Gathers the scans and joint states of messages into a log; leaves out malformed ones.

    Parameters
    ----------
    config
        Conventions of the messages, such as the joint, its sign and the delays of stamps.

    Attributes
    ----------
    scans
        The scans, in the order in which they came.
    joint
        Selects the samples of the nod joint.
    drops
        Malformed and misordered messages, counted by reason.
    """

    def __init__(self, config: AssemblerConfig) -> None:
        self.scans: list[Scan] = []
        self.drops: Counter[str] = Counter()
        self.joint = JointInput(config, self.drops)
        self._scan_input = ScanInput(config)
        self._samples: list[tuple[int, float]] = []

    def add_scan(self, message: Any, arrived_ns: int) -> None:
        """Add a LaserScan that arrived at an instant [ns]."""
        try:
            self.scans.append(self._scan_input.scan(message, arrived_ns))
        except RefusedScanError as error:
            self.drops[error.reason] += 1

    def add_joint_state(self, message: Any) -> None:
        """Add a JointState."""
        self._samples += self.joint.samples(message)

    def read(self, source: BagSource, wanted: Mapping[str, str]) -> SensorLog:
        """Return what some topics of a bag have, given with their types, and its damage."""
        for recorded in source.messages(wanted):
            if recorded.msgtype == SCAN:
                self.add_scan(recorded.message, recorded.time_ns)
            else:
                self.add_joint_state(recorded.message)
        return replace(self.log(), damage=source.damage)

    def log(self) -> SensorLog:
        """Return what was gathered, in the order of time."""
        stamps_ns = np.array([time_ns for time_ns, _ in self._samples], dtype=np.int64)
        pitch = np.array([pitch for _, pitch in self._samples], dtype=np.float64)
        scans = sorted(self.scans, key=lambda scan: scan.stamp_ns)
        return SensorLog(scans, *ordered_samples(stamps_ns, pitch), drops=self.drops)


def read_bag(path: Path, config: AssemblerConfig, topics: Topics = USUAL_TOPICS) -> SensorLog:
    """Return the scans and the samples of the nod joint in a ROS 2 bag.

    Parameters
    ----------
    path, config
        The bag; conventions of its messages.
    topics
        Topics to read; see Topics.

    Raises
    ------
    BagError
        If the bag has no valid scans or positions of that joint, lacks a topic, has several to
        choose from, or cannot be read at all.
    """
    gatherer = LogGatherer(config)
    with BagSource(path) as source:
        log = gatherer.read(source, source.inputs(topics))
    counts = (f'{count} {reason}' for reason, count in log.drops.items())
    drops = ', '.join([*counts, *log.damage])
    if not log.scans:
        raise BagError(f"'{path}' has no scans" + (f': {drops}' if drops else ''))
    if not len(log.sample_ns):
        why = gatherer.joint.missing_input or drops
        raise BagError(f"'{path}' has no positions of the joint '{config.joint_name}': {why}")
    return log


def read_drive(path: Path, config: AssemblerConfig, topics: Topics = USUAL_TOPICS) -> SensorLog:
    """Return the same with the odometry of frame_id; raises as `read_bag` and `with_odometry`."""
    return with_odometry(read_bag(path, config, topics), path, config, topics)


def with_odometry(
    log: SensorLog, path: Path, config: AssemblerConfig, topics: Topics = USUAL_TOPICS
) -> SensorLog:
    """Return a log of a bag with its odometry, and what of it could not be used.

    The odometry of frame_id is the transforms from odom_frame to its carrier. Of equal stamps the
    first one counts.

    Raises
    ------
    BagError
        If there are none (a chain of moving ones is not combined), a fixed one is not a pose, or
        the bag cannot be read.
    """
    odometry, drops, damage = _odometry(path, config, topics)
    damage = list(dict.fromkeys([*log.damage, *damage]))
    return replace(log, odometry=odometry, drops=log.drops + drops, damage=damage)


def _odometry(
    path: Path, config: AssemblerConfig, topics: Topics
) -> tuple[Odometry, Counter[str], list[str]]:
    """Return odometry, the transforms that could not be used, and the damage of the bag."""
    with BagSource(path) as source:
        topic = source.topic(TF, topics.tf)
        tf, drops = tf_in(source, topic, config), Counter[str]()
        poses = [
            pose
            for recorded in source.messages({topic: TF})
            for pose in tf.samples(recorded.message, drops)
        ]
        damage = source.damage
    if not poses:
        raise BagError(f"'{path}' has {tf.missing_input or next(iter(drops))}")
    stamps, places, turns = (np.array(each) for each in zip(*poses, strict=True))
    times_ns, first = np.unique(stamps, return_index=True)
    times_ns -= round(config.odometry_delay * NS_PER_S)
    odometry = Odometry(times_ns, Poses(places[first], turns[first])).mounted(tf.mount)
    return odometry, drops, damage
