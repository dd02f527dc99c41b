"""A scan of a log, with the samples that it is assembled with."""

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.pipeline import Pipeline, Scan
from nodlidar_common.arrays import Array, Integers
from nodlidar_common.stamps import NS_PER_S
import numpy as np

ODOMETRY_NS = NS_PER_S // 5  # before and after a scan, as the node keeps it


def samples_for(scan: Scan, log: SensorLog, pipeline: Pipeline) -> tuple[Integers, Array]:
    """Return the joint samples that a scan is assembled with: [ns], [rad], shape (n,)."""
    margin_ns = pipeline.estimator.margin_ns
    around = log.samples_around(scan.stamp_ns - margin_ns, scan.end_ns + margin_ns)
    return log.sample_ns[around], log.sample_pitch[around]


def odometry_for(scan: Scan, odometry: Odometry) -> Odometry:
    """Return the odometry that the node has for a scan."""
    near = np.flatnonzero(np.abs(odometry.time_ns - scan.stamp_ns) < ODOMETRY_NS)
    return Odometry(odometry.time_ns[near], odometry.poses[near])


def latency(log: SensorLog, pipeline: Pipeline, odometry: Odometry | None = None) -> float:
    """Return the median time from a scan's last beam to the last sample that it waits for [s].

    Parameters
    ----------
    log, pipeline
        The scans and joint samples, and what assembles them. The node waits for the joint sample
        after a scan with every estimator.
    odometry
        If every beam has its own pose.
    """
    ends_ns = np.array([scan.end_ns for scan in log.scans])
    wanted_ns = ends_ns + pipeline.estimator.margin_ns
    bracketed = wanted_ns <= log.sample_ns[-1]
    ends_ns, wanted_ns = ends_ns[bracketed], wanted_ns[bracketed]
    until_ns = log.sample_ns[np.searchsorted(log.sample_ns, wanted_ns)]
    if odometry is not None:
        after = np.searchsorted(odometry.time_ns, ends_ns)
        until_ns = np.maximum(until_ns, np.append(odometry.time_ns, 0)[after])
    return float(np.median(until_ns - ends_ns)) / NS_PER_S
