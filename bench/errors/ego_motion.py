"""The error that the robot's motion adds: a robot that stands, one that drives and rotates.

With the errors of lidar and servo, and without. Odometry has no errors.
"""

from collections.abc import Callable
from functools import partial

from nodlidar_assembler.clouds.ego_motion import OdometryConfig
from nodlidar_demo.evaluation import FAR, moved_surface_rms, near_beams, points_of_log
from nodlidar_demo.simulated_log import simulated_drive, simulated_log, simulated_odometry
from nodlidar_sim.simulation import Recording
import numpy as np

from bench.errors.accuracy import MIXED_PIXEL_ANGLE
from bench.shared.reference import (
    DEFAULT_N_S,
    DRIVING,
    joints_at,
    real_room,
    simulated_room,
    STANDING,
)
from bench.shared.report import Row

Distance = Callable[..., float]  # of a recording, an estimator and a mixed_pixel_angle

DURATION = 12.0  # almost a circle
JOINT_RATE = 100.0
DISTANCE = 'RMS distance, devices with errors [mm]'
FILTERED, IDEAL = 'the same, filtered [mm]', 'RMS distance, ideal devices [mm]'
TITLE = (
    f'Ego-motion: {DURATION:.0f} s in the room at N_s = {DEFAULT_N_S}, {DRIVING[0]} m/s and '
    f'{DRIVING[1]} rad/s, odometry at 50 Hz, joint states at {JOINT_RATE:g} Hz, distance of beams '
    f'up to {FAR:g} m'
)


def recordings(velocity: tuple[float, float]) -> dict[str, Recording]:
    """Return the recordings from a robot in the room, with real devices and with ideal ones."""
    sensor = joints_at(JOINT_RATE)
    return {
        DISTANCE: real_room(DURATION, sensor, velocity),
        IDEAL: simulated_room(DURATION, sensor=sensor, velocity=velocity),
    }


def beam_rms(
    simulated: Recording, estimator: str = 'slerp', mixed_pixel_angle: float = 0.0
) -> float:
    """Return the RMS distance of the points to the surfaces [m], with a pose for each beam."""
    log = near_beams(simulated_drive(simulated))
    points = points_of_log(log, estimator, mixed_pixel_angle)
    return moved_surface_rms(points.xyz, points.time_ns, simulated.world)


def scan_rms(
    simulated: Recording,
    estimator: str = 'slerp',
    mixed_pixel_angle: float = 0.0,
    *,
    instant: float,
) -> float:
    """Return the same with one pose per scan: that at a share of its duration, 0 .. 1."""
    points = points_of_log(near_beams(simulated_log(simulated)), estimator, mixed_pixel_angle)
    duration_ns = simulated.true_time_ns[:, -1] - simulated.scan_stamp_ns
    posed_ns = simulated.scan_stamp_ns + np.rint(instant * duration_ns).astype(np.int64)
    scan = np.searchsorted(simulated.scan_stamp_ns, points.time_ns, side='right') - 1
    poses = simulated_odometry(simulated).at(posed_ns, OdometryConfig())[scan]
    return moved_surface_rms(poses.to_parent(points.xyz), points.time_ns, simulated.world)


def distances(rms: Distance, by_devices: dict[str, Recording], estimator: str) -> Row:
    """Return the distances to the surfaces [mm] with real devices, filtered, and with ideal."""
    real, ideal = by_devices[DISTANCE], by_devices[IDEAL]
    return {
        DISTANCE: rms(real, estimator) * 1e3,
        FILTERED: rms(real, estimator, MIXED_PIXEL_ANGLE) * 1e3,
        IDEAL: rms(ideal, estimator) * 1e3,
    }


def results() -> list[Row]:
    """Return the RMS distance to the surfaces by the poses that are used."""
    standing, driving = recordings(STANDING), recordings(DRIVING)
    return [
        {
            'robot': robot,
            'poses': poses,
            **distances(rms, standing if robot == 'stands' else driving, 'slerp'),
        }
        for robot, poses, rms in (
            ('stands', 'one per beam', beam_rms),
            ('drives', 'one per beam', beam_rms),
            ('drives', 'one per scan, at its middle', partial(scan_rms, instant=0.5)),
            ('drives', 'one per scan, at its first beam', partial(scan_rms, instant=0.0)),
            ('drives', 'one per scan, a quarter on: the best', partial(scan_rms, instant=0.25)),
        )
    ]
