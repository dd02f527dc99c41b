"""Computation for one scan of 682 beams: from its arrays, those of the joint and of odometry.

To points: the structured array whose bytes a cloud is; and to the PointCloud2 message as well.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
import timeit

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_demo.evaluation import simulated_log, simulated_odometry
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np

from bench.reference import reference_nod, START_NS
from bench.report import Row

DURATION = 10.0
REPEATS = 20
TITLE = 'Assembly of one scan of 682 beams: medians over the scans of 10 s'

# Gives the odometry around a scan, anew whenever it is called.
OdometryAround = Callable[[Scan], Callable[[], Odometry | None]]


def results() -> list[Row]:
    """Return the time per scan of each estimator, and with odometry."""
    room = replace(load_scene('room'), base_velocity=(0.4, 0.5))
    simulated = simulate(room, reference_nod(), DURATION, start_ns=START_NS)
    log = replace(simulated_log(simulated), odometry=simulated_odometry(simulated))
    return [
        *(_row(name, log, name, lambda scan: lambda: None) for name in ESTIMATORS),
        _row('slerp, per-beam odometry', log, 'slerp', lambda scan: _checked(log, scan)),
        _row(
            'the same, and Odometry of its arrays',
            log,
            'slerp',
            lambda scan: _unchecked(log, scan),
        ),
    ]


def _row(name: str, log: SensorLog, estimator: str, around: OdometryAround) -> Row:
    pipeline = Pipeline(PipelineConfig(estimator=estimator))
    times = np.array([_times(pipeline, log, scan, around(scan)) for scan in log.scans[2:-3]])
    to_points, to_message = np.median(times, axis=0)
    return {
        'estimator': name,
        'to points [us]': to_points,
        'minimum [us]': times[:, 0].min(),
        'to message [us]': to_message,
    }


def _times(
    pipeline: Pipeline, log: SensorLog, scan: Scan, odometry: Callable[[], Odometry | None]
) -> tuple[float, float]:
    """Return the times of a scan to its points and to its message [us], means of repeats."""
    margin_ns = pipeline.estimator.margin_ns
    end_ns = scan.stamp_ns + pipeline.beams(scan.geometry).duration_ns
    around = log.samples_around(scan.stamp_ns - margin_ns, end_ns + margin_ns)
    samples = log.sample_ns[around], log.sample_pitch[around]

    def to_message() -> None:
        cloud_message(pipeline.add_scan(scan, *samples, odometry()).clouds[0], 'frame')

    return _mean(lambda: pipeline.add_scan(scan, *samples, odometry())), _mean(to_message)


def _mean(action: Callable[[], object]) -> float:
    return timeit.timeit(action, number=REPEATS) / REPEATS * 1e6


def _checked(log: SensorLog, scan: Scan) -> Callable[[], Odometry]:
    """Return what gives the odometry around a scan, made beforehand."""
    odometry = _unchecked(log, scan)()
    return lambda: odometry


def _unchecked(log: SensorLog, scan: Scan) -> Callable[[], Odometry]:
    """Return what makes the odometry around a scan of its arrays, as is done for every scan."""
    assert log.odometry is not None
    time_ns, poses = log.odometry.time_ns, log.odometry.poses
    first, last = np.searchsorted(time_ns, [scan.stamp_ns, scan.stamp_ns + 70_000_000])
    near: Sequence[int] = range(first - 1, last + 1)
    arrays = time_ns[near], Poses(poses.position[near], poses.orientation[near])
    return lambda: Odometry(*arrays)
