"""How the pitch of a beam and the robot's motion are told: error, time per scan, added latency."""

from collections.abc import Callable
from itertools import product

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_common.nod import NS_PER_S
from nodlidar_demo.evaluation import simulated_log, simulated_odometry, xyz_of
from nodlidar_sim.simulation import Recording
import numpy as np
from numpy.typing import NDArray
from transforms3d.quaternions import quat2mat

from bench.ego_motion import beam_rms, DISTANCE, recording, scan_rms, SPEED, TURN_RATE
from bench.hot_paths import Action, interleaved
from bench.report import Row

ROUNDS = 40
EGO_MOTION: dict[str, Callable[[Recording, str], float]] = {
    # Whoever uses the cloud takes the pose at its stamp, that of the first beam.
    'off': lambda simulated, estimator: scan_rms(simulated, 0.0, estimator),
    'per scan': lambda simulated, estimator: scan_rms(simulated, 0.5, estimator),
    'per beam': beam_rms,
}
ODOMETRY_NS = NS_PER_S // 5  # around a scan, of what the node keeps
TITLE = (
    f'Estimators and ego-motion: a robot in the room at {SPEED} m/s and {TURN_RATE} rad/s, '
    'joint states at 62 Hz, odometry at 50 Hz'
)


def results() -> list[Row]:
    """Return a row for each estimator with each way to compensate the motion."""
    simulated = recording(SPEED, TURN_RATE)
    log, odometry = simulated_log(simulated), simulated_odometry(simulated)
    both = list(product(ESTIMATORS, EGO_MOTION))
    actions = {f'{one}, {other}': _action(one, other, log, odometry) for one, other in both}
    times = dict(zip(both, interleaved(actions, ROUNDS), strict=True))
    return [
        {
            'estimator': estimator,
            'ego-motion': motion,
            DISTANCE: EGO_MOTION[motion](simulated, estimator) * 1e3,
            'time per scan [us]': times[estimator, motion][0] * 1e6,
            'latency after the last beam [ms]': latency(log, odometry, estimator, motion) * 1e3,
        }
        for estimator, motion in both
    ]


def _action(estimator: str, motion: str, log: SensorLog, odometry: Odometry) -> Action:
    """Return what makes points of a scan in the middle of a log."""
    pipeline, scan = _pipeline(estimator), log.scans[len(log.scans) // 2]
    margin_ns, end_ns = pipeline.estimator.margin_ns, _end_ns(scan)
    around = log.samples_around(scan.stamp_ns - margin_ns, end_ns + margin_ns)
    samples = log.sample_ns[around], log.sample_pitch[around]
    near = np.flatnonzero(np.abs(odometry.time_ns - scan.stamp_ns) < ODOMETRY_NS)
    given = Odometry(odometry.time_ns[near], odometry.poses[near])
    if motion == 'per beam':
        return lambda: pipeline.add_scan(scan, *samples, given)
    if motion == 'off':
        return lambda: pipeline.add_scan(scan, *samples)

    def per_scan() -> None:
        points = pipeline.add_scan(scan, *samples).clouds[0]
        pose = given.at(np.array([(scan.stamp_ns + end_ns) // 2]), OdometryConfig())
        x, y, z, w = pose.orientation[0]
        moved = xyz_of(points) @ quat2mat([w, x, y, z]).T + pose.position
        points.data['x'], points.data['y'], points.data['z'] = moved.T

    return per_scan


def latency(log: SensorLog, odometry: Odometry, estimator: str, motion: str) -> float:
    """Return the median time from a scan's last beam to the last sample that it waits for [s].

    The nearest joint sample and the pose at a scan's middle are there before its last beam, but
    the node waits for the sample after it.
    """
    margin_ns = _pipeline(estimator).estimator.margin_ns
    ends_ns = np.array([_end_ns(scan) for scan in log.scans])
    until_ns = _next(log.sample_ns, ends_ns + margin_ns)
    if motion == 'per beam':
        until_ns = np.maximum(until_ns, _next(odometry.time_ns, ends_ns))
    waited = until_ns[until_ns >= ends_ns + margin_ns] - ends_ns[until_ns >= ends_ns + margin_ns]
    return float(np.median(waited)) / NS_PER_S


def _next(samples_ns: NDArray[np.int64], times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first sample that is not before each time, or the last one."""
    after = np.searchsorted(samples_ns, times_ns)
    return np.asarray(samples_ns[np.minimum(after, len(samples_ns) - 1)])


def _pipeline(estimator: str) -> Pipeline:
    return Pipeline(PipelineConfig(estimator=estimator))


def _end_ns(scan: Scan) -> int:
    return scan.stamp_ns + _pipeline('slerp').beams(scan.geometry).duration_ns
