"""Computation for one scan of 682 beams: from its arrays to its points."""

import timeit

from nodlidar_assembler.geometry import REFERENCE_MOUNT
from nodlidar_assembler.pipeline import Pipeline
from nodlidar_assembler.pitch_estimator import ESTIMATORS
from nodlidar_bringup.evaluation import MAX_JOINT_GAP, simulated_log
import numpy as np
from rich.table import Table

from bench.reference import simulated_room

REPEATS = 30


def table() -> Table:
    """Return the time per scan of each estimator."""
    result = Table(title='Assembly of one scan of 682 beams: from arrays to points')
    result.add_column('estimator')
    for heading in ('median', 'minimum', 'points'):
        result.add_column(heading, justify='right')
    for estimator in ESTIMATORS:
        times, points = scan_times(estimator)
        result.add_row(
            estimator, f'{np.median(times):.0f} us', f'{np.min(times):.0f} us', f'{points}'
        )
    return result


def scan_times(estimator: str) -> tuple[list[float], int]:
    """Return the time of scans [us], each the mean of some repeats, and the points of the last."""
    log = simulated_log(simulated_room(10.0))
    pipeline = Pipeline(estimator, 'scan', REFERENCE_MOUNT, MAX_JOINT_GAP)
    times = []
    for scan in log.scans[1:-1]:
        duration_ns = pipeline.beams(scan.geometry).duration_ns
        margin_ns = pipeline.estimator.margin_ns
        end_ns = scan.stamp_ns + duration_ns
        around = log.samples_around(scan.stamp_ns - margin_ns, end_ns + margin_ns)
        given = scan, log.sample_ns[around], log.sample_pitch[around]
        seconds = timeit.timeit(lambda given=given: pipeline.add_scan(*given), number=REPEATS)
        times.append(seconds / REPEATS * 1e6)
        points = len(pipeline.add_scan(*given)[0].data)
    return times, points
