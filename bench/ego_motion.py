"""What the robot's motion costs in accuracy: a robot that stands, one that drives and turns."""

from dataclasses import replace

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig
from nodlidar_demo.evaluation import (
    FAR,
    moved_surface_rms,
    near_beams,
    points_of,
    simulated_log,
    simulated_odometry,
    xyz_of,
)
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
from numpy.typing import NDArray

from bench.reference import reference_nod, START_NS
from bench.report import Row

SPEED, TURN_RATE = 0.4, 0.5
DURATION = 12.0  # almost a circle
SEEDS = range(15)
TURN_ERROR = 0.003  # of the servo, standard deviation [s]
DRIFT = 0.02
DISTANCE = f'RMS distance to the surfaces, beams up to {FAR:g} m [mm]'
TITLE = (
    f'Ego-motion: {DURATION:.0f} s in the room, {SPEED} m/s and {TURN_RATE} rad/s, '
    f'odometry at 50 Hz, joint states at 62 Hz, turns {TURN_ERROR * 1e3:.0f} ms off'
)


def recording(
    speed: float, turn_rate: float, drift: float = 0.0, seed: int = 0, duration: float = DURATION
) -> Recording:
    """Return the reference sensor's recording from a robot that drives a circle in the room."""
    room = load_scene('room')
    effects = replace(room.effects, odometry_error=drift, servo_jitter=TURN_ERROR)
    scene = replace(room, base_velocity=(speed, turn_rate), effects=effects)
    return simulate(scene, reference_nod(), duration, seed, start_ns=START_NS)


def beam_rms(simulated: Recording, estimator: str = 'slerp') -> float:
    """Return the RMS distance of the points to the surfaces [m], every beam at its own pose."""
    log = replace(near_beams(simulated_log(simulated)), odometry=simulated_odometry(simulated))
    points = points_of(log, estimator)
    return moved_surface_rms(xyz_of(points), points.time_ns, simulated.world)


def scan_rms(simulated: Recording, instant: float, estimator: str = 'slerp') -> float:
    """Return the same with one pose per scan: that at a share of its duration, 0 .. 1."""
    points = points_of(near_beams(simulated_log(simulated)), estimator)
    moved = _at_pose_of_scan(points, simulated, simulated_odometry(simulated), instant)
    return moved_surface_rms(moved, points.time_ns, simulated.world)


def _at_pose_of_scan(
    points: Points, simulated: Recording, odometry: Odometry, instant: float
) -> NDArray[np.float64]:
    duration_ns = simulated.true_time_ns[:, -1] - simulated.scan_stamp_ns
    posed_ns = simulated.scan_stamp_ns + np.rint(instant * duration_ns).astype(np.int64)
    scan = np.searchsorted(simulated.scan_stamp_ns, points.time_ns, side='right') - 1
    return odometry.at(posed_ns, OdometryConfig())[scan].to_parent(xyz_of(points))


def drifting(duration: float) -> list[tuple[str, str, float]]:
    """Return the rows of odometry whose wheels are wrong by DRIFT, all points in one cloud."""
    robot = f'drives {duration:.0f} s, wheels {DRIFT:.0%} off'
    runs = [beam_rms(recording(SPEED, TURN_RATE, DRIFT, seed, duration)) for seed in SEEDS]
    return [
        (robot, f'each beam its own, median of {len(runs)}', float(np.median(runs))),
        (robot, 'each beam its own, worst', max(runs)),
    ]


def results() -> list[Row]:
    """Return the RMS distance to the surfaces by what is known of the motion."""
    standing = beam_rms(recording(0.0, 0.0))
    driving = recording(SPEED, TURN_RATE)
    return [
        {'robot': robot, 'poses': poses, DISTANCE: rms * 1e3, 'to standing': rms / standing}
        for robot, poses, rms in (
            ('stands', 'each beam its own', standing),
            ('drives', 'each beam its own', beam_rms(driving)),
            ('drives', 'one per scan, at its middle', scan_rms(driving, 0.5)),
            ('drives', 'one per scan, at its first beam', scan_rms(driving, 0.0)),
            ('drives', 'one per scan, a quarter on: the best', scan_rms(driving, 0.25)),
            *drifting(1.0),
            *drifting(DURATION),
        )
    ]
