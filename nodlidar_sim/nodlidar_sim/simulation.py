"""The fast mode: simulates a recording as arrays, without devices, ROS or waiting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import math

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.nodding import nodding_servo
from nodlidar_sim.world.effects import Effects, Measure, range_faults
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.nod_motion import Motion, triangle_motion
from nodlidar_sim.world.odometry import Odometer
from nodlidar_sim.world.scene import Scene
from nodlidar_sim.world.sensor_model import instants, SensorModel
from nodlidar_sim.world.world import World
import numpy as np

_SCANS_AT_ONCE = 24  # the arrays of one ray cast then fit the cache


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The measurements of the devices, and the truth.

    Attributes
    ----------
    sensor
        The devices.
    azimuth
        Angle of each beam in the scan plane [rad], shape (b,).
    scan_stamp_ns
        Time of the first measured beam of each scan [ns], shape (s,).
    ranges
        As measured [m], shape (s, b); inf too far, -inf too near, NaN dropped out.
    joint_stamp_ns, joint_position
        Time [ns] and pitch [rad] as measured by the servo, shape (j,).
    odometry_stamp_ns, odometry_pose
        Time [ns], shape (o,), and x [m], y [m], yaw [rad] of base_link in odom, shape (o, 3).
    true_time_ns, true_pitch, true_range
        Time [ns], pitch of the lidar [rad] and range [m] of each beam, shape (s, b).
    true_encoder_pitch
        Pitch [rad] that the encoder would report without steps and noise, at the same times, shape
        (s, b). Backlash and the encoder's nonlinearity, which no joint sample shows, are what
        true_pitch differs by.
    true_pose
        x [m], y [m], yaw [rad] of base_link in odom at the odometry's times, shape (o, 3).
    world
        The simulated world, which also computes the distance of points from the surfaces.
    """

    sensor: SensorModel
    azimuth: Array
    scan_stamp_ns: Times
    ranges: Array
    joint_stamp_ns: Times
    joint_position: Array
    odometry_stamp_ns: Times
    odometry_pose: Array
    true_time_ns: Times
    true_pitch: Array
    true_range: Array
    true_encoder_pitch: Array
    true_pose: Array
    world: World


def simulate(
    scene: Scene,
    nod: Nod,
    duration: float,
    seed: int = 0,
    *,
    start_ns: int = 0,
    sensor: SensorModel | None = None,
) -> Recording:
    """Simulate a nodding lidar in a scene; equal arguments return equal recordings.

    Parameters
    ----------
    scene
        From nodlidar_sim.world.scene.load_scene.
    nod
        The commanded nod; an ideal servo follows it as in `triangle_motion`, a servo by
        physics as in `nodding_servo`.
    duration
        Of the recording [s]; it contains the scans that end within it.
    seed
        Of all effects.
    start_ns
        Time of step 0 of the first scan, when base and objects leave their start [ns].
    sensor
        The devices; a URG-04LX-UG01 on an RX-24F by default.

    Raises
    ------
    ParameterError
        If the duration is too short for a scan, or a sweep of the nod for its reversals.
    """
    sensor = SensorModel() if sensor is None else sensor
    effects = scene.effects
    scans = math.floor(duration * effects.clock_rate / sensor.scan_time + 1e-9)
    if scans < 1:
        raise ParameterError('duration', f'at least {sensor.scan_time} s, one scan', duration)
    end_ns = start_ns + math.ceil((duration + 2.0 / sensor.joint_rate) * NS_PER_S)
    seeds = np.random.SeedSequence(seed).generate_state(4)
    range_seed, turn_seed, odometry_seed, lidar_seed = seeds.tolist()
    joints_ns = _ticks(start_ns, duration, sensor.joint_rate)
    nodding = _nodding(scene, nod, sensor, (start_ns, end_ns), turn_seed)
    motion = nodding.motion
    world = World(scene, motion, start_ns=start_ns)
    beams_ns = sensor.beam_times_ns(start_ns, scans, effects.clock_rate)
    samples_ns = _ticks(start_ns, duration, sensor.odometry_rate)
    true_pose = pose = Odometer(world.base, Effects(), start_ns).poses(samples_ns)
    if effects.affect_odometry:
        pose = Odometer(world.base, effects, start_ns, odometry_seed).poses(samples_ns)
    undisturbed = partial(world.ranges, elevation=scene.lidar.elevation)
    true_range = ranges = _in_pieces(undisturbed, beams_ns, sensor.azimuth)
    if not scene.lidar.ideal:
        lidar = Lidar(scene.lidar, world, start_ns, lidar_seed)
        ranges = _in_pieces(lidar.ranges, beams_ns, sensor.azimuth)
    faults = range_faults(effects, range_seed)
    return Recording(
        sensor=sensor,
        azimuth=sensor.azimuth,
        scan_stamp_ns=beams_ns[:, 0],
        ranges=sensor.rounded_ranges(ranges if faults is None else faults(ranges)),
        joint_stamp_ns=joints_ns,
        joint_position=nodding.encoder(joints_ns),
        odometry_stamp_ns=samples_ns,
        odometry_pose=pose,
        true_time_ns=beams_ns,
        true_pitch=motion.position(beams_ns),
        true_range=true_range,
        true_encoder_pitch=nodding.smooth_encoder(beams_ns),
        true_pose=true_pose,
        world=world,
    )


@dataclass(frozen=True, slots=True)
class _Nodding:
    """The motion of the lidar, and what encoders without and with steps and noise report."""

    motion: Motion
    smooth_encoder: Callable[[Times], Array]
    encoder: Callable[[Times], Array]


def _nodding(
    scene: Scene, nod: Nod, sensor: SensorModel, interval_ns: tuple[int, int], seed: int
) -> _Nodding:
    """Return the nod in an interval [ns], of an ideal servo or of the scene's."""
    if scene.servo is not None:
        servo = nodding_servo(scene.servo, nod, sensor, *interval_ns, seed)
        return _Nodding(servo, servo.smooth_encoder, servo.encoder)
    jitter = scene.effects.servo_jitter
    ideal = triangle_motion(nod, *interval_ns, sensor.acceleration, jitter, seed)

    def encoder(times_ns: Times) -> Array:
        return _rounded(ideal.position(times_ns), sensor.joint_tick)

    return _Nodding(ideal, ideal.position, encoder)


def _ticks(start_ns: int, duration: float, rate: float) -> Times:
    """Return instants [ns] at a rate [Hz], from the start to the end of a duration [s] or past."""
    return instants(start_ns, np.arange(math.ceil(duration * rate) + 1) / rate)


def _in_pieces(measure: Measure, beams_ns: Times, azimuth: Array) -> Array:
    """Return the range of every beam, shape (s, b), computed a few scans at a time."""
    ranges = np.empty(beams_ns.shape)
    for first in range(0, len(beams_ns), _SCANS_AT_ONCE):
        times = beams_ns[first : first + _SCANS_AT_ONCE]
        found = measure(times.ravel(), np.tile(azimuth, len(times)))
        ranges[first : first + _SCANS_AT_ONCE] = found.reshape(times.shape)
    return ranges


def _rounded(values: Array, step: float) -> Array:
    steps: Array = np.rint(values / step)
    return steps * step
