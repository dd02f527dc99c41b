"""Simulated drives, and how far a path is from the true one."""

from dataclasses import replace

from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.arrays import Array
from nodlidar_common.nod import Nod
from nodlidar_mapper.geometry.poses import inverse, planar
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import load_scene, Scene
import numpy as np

from bench.shared.reference import START_NS
from bench.shared.rms import rms

DRIVES = (('room', 'figure_of_eight', 100.0), ('corridor', None, 120.0), ('building', None, 200.0))
ODOMETRY = {'odometry_error': 0.004, 'wheel_slip': 0.02}
IDEAL_NOISE = 0.01  # m
FAST = 1.2  # m/s, of the fast drives
CONFIG = PROFILES['slam']


def top_speed(scene: Scene) -> float:
    """Return the highest speed of a drive [m/s]."""
    return max(leg.velocity[0] for leg in scene.base_legs)


def speed_up(name: str, route: str | None) -> float:
    """Return how many times faster than by its route a scene is driven at 1.2 m/s."""
    return FAST / top_speed(load_scene(name, route))


def scene_of(name: str, route: str | None, faster: float, ideal: bool) -> Scene:
    """Return a scene with errors of odometry and a faster drive."""
    scene = load_scene(name, route, ideal=ideal)
    noise = {'range_noise': IDEAL_NOISE} if ideal else {}
    legs = tuple(
        Leg(leg.duration / faster, (leg.velocity[0] * faster, leg.velocity[1] * faster))
        for leg in scene.base_legs
    )
    return replace(scene, effects=replace(scene.effects, **ODOMETRY, **noise), base_legs=legs)


def recorded(scene: Scene, duration: float, seed: int) -> Recording:
    """Return a recording of a drive with the default nod."""
    n_s = CONFIG.samples_per_sweep
    nod = Nod(CONFIG.pitch_min, CONFIG.pitch_max, n_s / 10240, n_s, START_NS)
    return simulate(scene, nod, duration, seed, start_ns=START_NS)


def true_poses(recording: Recording, stamps_ns: Array) -> Array:
    """Return the true poses of the base at instants [ns], as matrices."""
    since = recording.odometry_stamp_ns - START_NS
    x, y = (np.interp(stamps_ns - START_NS, since, recording.true_pose[:, k]) for k in (0, 1))
    yaw = np.interp(stamps_ns - START_NS, since, np.unwrap(recording.true_pose[:, 2]))
    return np.stack([planar(*pose) for pose in zip(x, y, yaw, strict=True)])


def errors(truth: Array, poses: list[Array]) -> Array:
    """Return the errors of positions, aligned at the first pose [m], shape (n,)."""
    aligned = truth[0] @ inverse(poses[0]) @ np.stack(poses)
    return np.asarray(np.linalg.norm(aligned[:, :3, 3] - truth[:, :3, 3], axis=1))


def rms_error(truth: Array, poses: list[Array]) -> float:
    """Return the root mean square of these errors [m]."""
    return rms(errors(truth, poses))
