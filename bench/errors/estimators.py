"""The estimators of pitch, and ways to compensate motion: error, time per scan, added latency."""

from functools import partial
from itertools import product

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_demo.simulated_log import simulated_log, simulated_odometry
import numpy as np
from transforms3d.quaternions import quat2mat

from bench.errors.ego_motion import (
    beam_rms,
    DISTANCE,
    Distance,
    distances,
    JOINT_RATE,
    recordings,
    scan_rms,
)
from bench.shared.reference import DEFAULT_N_S, DRIVING
from bench.shared.report import Row
from bench.shared.scans import latency, odometry_for, samples_for
from bench.shared.timing import Action, interleaved

ROUNDS = 40
EGO_MOTION: dict[str, Distance] = {
    # The consumer of a cloud uses the pose at its stamp, that of the first beam.
    'off': partial(scan_rms, instant=0.0),
    'per scan': partial(scan_rms, instant=0.5),
    'per beam': beam_rms,
}
TITLE = (
    f'Estimators and ego-motion: a robot in the room at {DRIVING[0]} m/s and {DRIVING[1]} rad/s, '
    f'N_s = {DEFAULT_N_S}, joint states at {JOINT_RATE:g} Hz, odometry at 50 Hz'
)


def results() -> list[Row]:
    """Return a row for each estimator with each way to compensate the motion."""
    driving = recordings(DRIVING)
    log, odometry = simulated_log(driving[DISTANCE]), simulated_odometry(driving[DISTANCE])
    both = list(product(ESTIMATORS, EGO_MOTION))
    actions = {f'{one}, {other}': _action(one, other, log, odometry) for one, other in both}
    times = dict(zip(both, interleaved(actions, ROUNDS), strict=True))
    return [
        {
            'estimator': estimator,
            'ego-motion': motion,
            **distances(EGO_MOTION[motion], driving, estimator),
            'time per scan [us]': times[estimator, motion][0] * 1e6,
            'latency after the last beam [ms]': latency(
                log, _pipeline(estimator), odometry if motion == 'per beam' else None
            )
            * 1e3,
        }
        for estimator, motion in both
    ]


def _action(estimator: str, motion: str, log: SensorLog, odometry: Odometry) -> Action:
    """Return an action that makes the points of a scan in the middle of a log."""
    pipeline, scan = _pipeline(estimator), log.scans[len(log.scans) // 2]
    samples, near = samples_for(scan, log, pipeline), odometry_for(scan, odometry)
    if motion == 'per beam':
        return lambda: pipeline.add_scan(scan, *samples, near)
    if motion == 'off':
        return lambda: pipeline.add_scan(scan, *samples)
    middle_ns = (scan.stamp_ns + scan.end_ns) // 2

    def per_scan() -> None:
        points = pipeline.add_scan(scan, *samples).clouds[0]
        pose = near.at(np.array([middle_ns]), OdometryConfig())
        x, y, z, w = pose.orientation[0]
        moved = points.xyz @ quat2mat([w, x, y, z]).T + pose.position
        points.data['x'], points.data['y'], points.data['z'] = moved.T

    return per_scan


def _pipeline(estimator: str) -> Pipeline:
    return Pipeline(PipelineConfig(estimator=estimator))
