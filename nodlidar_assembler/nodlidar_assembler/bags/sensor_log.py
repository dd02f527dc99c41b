"""A whole recording, of a bag or of the simulator, and its clouds: no message is late."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.scan_assembler import Outcome
from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ScanError
import numpy as np


@dataclass(frozen=True, slots=True)
class SensorLog:
    """Scans, joint samples and, for points in the frame of odometry, odometry.

    Attributes
    ----------
    scans
        In the order of their time.
    sample_ns, sample_pitch
        Stamps [ns] and positions [rad] of the nod's joint, ascending, shape (n,).
    odometry
        Of nodlidar_base_link.
    drops
        Messages that could not be used, counted by reason.
    damage
        What of the bag could not be read, in words.
    """

    scans: Sequence[Scan]
    sample_ns: Times
    sample_pitch: Array
    odometry: Odometry | None = None
    drops: Counter[str] = field(default_factory=Counter)
    damage: Sequence[str] = ()

    def samples_around(self, begin_ns: int, end_ns: int) -> slice:
        """Return the joint samples that closely bracket an interval [ns], as far as recorded."""
        first = int(np.searchsorted(self.sample_ns, begin_ns, side='right')) - 1
        last = int(np.searchsorted(self.sample_ns, end_ns, side='left'))
        return slice(max(first, 0), min(last + 1, len(self.sample_ns)))


def outcomes(log: SensorLog, config: PipelineConfig) -> Iterator[Outcome]:
    """Yield what becomes of each scan of a log.

    All samples are known, however late they came; a BagReplay waits for them as the node does.
    """
    pipeline = Pipeline(config)
    margin_ns = pipeline.estimator.margin_ns
    jumps_ns = np.empty(0, dtype=np.int64)
    if log.odometry is not None:
        jumps_ns = log.odometry.jumps_ns(config)
    samples_added = 0
    jumps_before = 0  # until the last scan that was assembled
    for scan in log.scans:
        around = log.samples_around(scan.stamp_ns - margin_ns, scan.end_ns + margin_ns)
        for k in range(samples_added, around.stop):
            pipeline.add_sample(int(log.sample_ns[k]), float(log.sample_pitch[k]))
        samples_added = max(samples_added, around.stop)
        jumps = int(np.searchsorted(jumps_ns, scan.stamp_ns, side='right'))
        samples = log.sample_ns[around], log.sample_pitch[around]
        try:
            assembled = pipeline.add_scan(scan, *samples, log.odometry, jumps > jumps_before)
        except ScanError as error:
            yield Outcome(scan, dropped=error.reason)
        else:
            jumps_before = jumps
            yield Outcome(scan, assembled)


def assemble_log(log: SensorLog, config: PipelineConfig) -> tuple[list[Points], Counter[str]]:
    """Return a log's clouds, and what was dropped, counted by reason."""
    clouds: list[Points] = []
    drops = log.drops.copy()
    for outcome in outcomes(log, config):
        if outcome.assembled is None:
            drops[outcome.dropped] += 1
        else:
            clouds += outcome.assembled.clouds
    return clouds, drops


def clouds_in(log: SensorLog, config: PipelineConfig) -> tuple[list[Points], Counter[str]]:
    """Return the same for a log that was read; raises BagError if there is no cloud."""
    clouds, drops = assemble_log(log, config)
    if not clouds:
        reasons = ', '.join(f'{count} {reason}' for reason, count in drops.items())
        raise BagError(f'no cloud from {len(log.scans)} scans: {reasons or "no whole sweep"}')
    return clouds, drops
