"""Speed for accuracy: what a faster or a slower nod gains and loses, in three scenes.

For each speed the planner chooses an N_s, the simulator records it with the errors of lidar and
servo, and the cloud is assembled by `slerp`, as the node does by default, and filtered. Beside it
are the completion and the cloud of ideal devices. A nod on a front is one that the servo holds,
and no other such nod is better at both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import degrees, inf, isfinite, pi, sin, tau

from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.observed_coverage import largest_square
from nodlidar_common.arrays import Array, Integers, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.evaluation import FAR, near_beams, points_of_log, surface_rms
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.task import Task
from nodlidar_sim.nodding import nodding_servo
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.nod_motion import triangle_motion
from nodlidar_sim.world.scene import load_scene, Scene
import numpy as np

from bench.errors.accuracy import MIXED_PIXEL_ANGLE, points_rms
from bench.shared.reference import (
    BEAM_PERIOD,
    joints_at,
    reference_nod,
    REVERSAL_ERROR,
    STANDING,
    START_NS,
)
from bench.shared.report import Row

SCENES = ('room', 'corner', 'corridor')
ABOUT = (1001, 1401, 2001, 2801, 4001, 5601, 8001, 11201, 14001, 20001)
WITHIN = 0.05  # of them the planner chooses N_s
DURATION = 20.0  # of a recording [s]
EARLY, AFTER = (
    0.5,
    5.0,
)  # holes are those after these times; density and repeats after the latter [s]
RUNS = 5  # with other errors of the encoder; of completion, hole and repeats the median counts
NOD = Task()
# What ideal nods of up to 5 rad/s reach: they reverse short of the limits.
REGION = replace(NOD, pitch_min=-0.55, pitch_max=0.55)
# The same in squares as wide as a step of azimuth, one around every step.
FINE = replace(REGION, object_size=4.0 * sin(pi / 1024), azimuth=340.5 * tau / 1024)
NEAR, QUERIES = 0.1, 200  # density: distance [m] from this many points of the surfaces

SENSOR, RX24F = joints_at(100.0), load_servo('rx24f')
HELD, CANNOT_REVERSE = 'holds it', 'cannot reverse so soon'

SCENE, N_S, SPEED, SERVO = 'scene', 'N_s', 'speed [rad/s]', 'servo'
COMPLETION, IDEAL_COMPLETION = 'completion [s]', 'completion, ideal servo [s]'
EARLY_HOLE, HOLE = (f'largest hole after {after:g} s [°]' for after in (EARLY, AFTER))
DENSITY, SPARSE = 'density [points/m2]', 'of the sparsest tenth [points/m2]'
REPEATS = 'repeats [%]'
RMS, IDEAL = 'RMS distance [mm]', 'RMS distance, ideal devices [mm]'
FRONTS = {'front of completion': COMPLETION, f'front of holes after {EARLY:g} s': EARLY_HOLE}
TITLE = (
    '10 cm at 2 m within 0.55 rad of level, nod 0.6136 rad up and down, URG-04LX-UG01 on an '
    f'RX-24F, joint states at 100 Hz, beams up to {FAR:g} m, filtered'
)


def results() -> list[Row]:
    """Return the figures of each scene and nod, and which are on the front."""
    nods = [_coverage_row(chosen(about)) for about in ABOUT]
    rows = []
    for name in SCENES:
        of_scene = list(_scene_rows(name, nods))
        _mark_fronts([row for row in of_scene if row[SERVO] == HELD])
        rows += of_scene
    return rows


def chosen(about: int) -> int:
    """Return the N_s near a number that the planner chooses for the task and the servo."""
    slowest, fastest = (NOD.speed(1) / (about * (1.0 + side * WITHIN)) for side in (1, -1))
    return quick_choice(NOD, samples_in_band(NOD, slowest, fastest), REVERSAL_ERROR)


def nod_of(samples_per_sweep: int) -> Nod:
    """Return the nod of an N_s between the limits of the reference nod."""
    return replace(
        reference_nod(),
        sweep_duration=samples_per_sweep * BEAM_PERIOD,
        samples_per_sweep=samples_per_sweep,
    )


def first_hits(times_ns: Times, pitch: Array, task: Task) -> Array:
    """Return when a cell was first hit [s], infinite if never; shape (columns, rows).

    Parameters
    ----------
    times_ns, pitch
        Of each beam of each scan [ns], [rad], shape (s, b).
    task
        Defines the cells; beams outside its region hit none.
    """
    height = (pitch - task.pitch_min) / task.span
    cell = _columns(task) * task.rows + task.row_of_height(height, samples_per_sweep=1)
    inside = (_columns(task) >= 0) & (height >= 0.0) & (height <= 1.0)
    first = np.full(task.cells + 1, inf)
    where = np.where(inside, cell, task.cells).ravel()[::-1]
    first[where] = (times_ns.ravel()[::-1] - START_NS) / NS_PER_S
    return first[:-1].reshape(task.columns, task.rows)


def local_density(xyz: Array, queries: Array) -> Array:
    """Return the points (n, 3) within NEAR of each query, per area of a disc of it [1/m^2]."""
    squares = (queries**2).sum(axis=1)[:, None] - 2.0 * queries @ xyz.T + (xyz**2).sum(axis=1)
    return np.asarray((squares < NEAR**2).sum(axis=1) / (pi * NEAR**2))


def on_front(rows: Sequence[Row], *keys: str) -> list[bool]:
    """Return which rows have no other that is at least as good by all keys, and better by one."""
    table = [[inf if row.get(key) is None else row[key] for key in keys] for row in rows]
    values = np.array(table).reshape(-1, len(keys))
    no_worse = (values[:, None] <= values).all(axis=2)  # [i, j]: i than j
    better = no_worse & (values[:, None] < values).any(axis=2)
    return list(~better.any(axis=0) & np.isfinite(values).all(axis=1))


def _columns(task: Task) -> Integers:
    """Return the column of each measured beam, -1 outside the region."""
    return task.column_of_step()[SENSOR.first_step : SENSOR.last_step + 1]


def _coverage_row(samples_per_sweep: int) -> Row:
    """Return what a nod covers in any scene, and whether a servo holds it."""
    speed = NOD.speed(samples_per_sweep)
    row: Row = {N_S: samples_per_sweep, SPEED: speed, SERVO: HELD}
    if speed > AssemblerConfig().max_nod_speed:
        row[SERVO] = 'too fast under load'
    nod = nod_of(samples_per_sweep)
    times_ns = SENSOR.beam_times_ns(START_NS, round(DURATION / SENSOR.scan_time), 1.0)
    end_ns = int(times_ns[-1, -1])
    try:
        ideal = triangle_motion(nod, START_NS, end_ns, SENSOR.acceleration)
    except ParameterError:
        return row | {SERVO: CANNOT_REVERSE}
    servos = [nodding_servo(RX24F, nod, SENSOR, START_NS, end_ns, seed) for seed in range(RUNS)]
    runs = [_figures(times_ns, servo.position(times_ns)) for servo in servos]
    completion, *others = np.quantile(runs, 0.5, axis=0, method='higher')
    row[COMPLETION] = _finite(completion)
    row[IDEAL_COMPLETION] = _finite(_figures(times_ns, ideal.position(times_ns))[0])
    return row | dict(zip((EARLY_HOLE, HOLE, REPEATS), others, strict=True))


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _figures(times_ns: Times, pitch: Array) -> tuple[float, float, float, float]:
    """Return completion [s], the early and the later hole [deg] and repeats [%] of one run."""
    first = first_hits(times_ns, pitch, FINE)
    early_hole, hole = (
        degrees(largest_square(first >= after) * FINE.cell) for after in (EARLY, AFTER)
    )
    taken = (times_ns - START_NS < AFTER * NS_PER_S) & (_columns(FINE) >= 0)
    beams = np.count_nonzero(taken & (pitch >= FINE.pitch_min) & (pitch <= FINE.pitch_max))
    repeats = 100.0 * (1.0 - np.count_nonzero(first < AFTER) / beams)
    return float(first_hits(times_ns, pitch, REGION).max()), early_hole, hole, repeats


def _scene_rows(name: str, nods: Sequence[Row]) -> Iterator[Row]:
    real, ideal = (
        load_scene(name, ideal=ideal).with_velocity(STANDING) for ideal in (False, True)
    )
    queries = _surface_points(ideal)
    for nod in nods:
        row = {SCENE: name, **nod}
        if nod[SERVO] != CANNOT_REVERSE:
            recording = _recording(real, nod_of(nod[N_S]))
            row |= _cloud_row(recording, queries)
            row[IDEAL] = points_rms(_recording(ideal, nod_of(nod[N_S])), 'slerp') * 1e3
        yield row


def _recording(scene: Scene, nod: Nod) -> Recording:
    return simulate(scene, nod, DURATION, start_ns=START_NS, sensor=SENSOR)


def _cloud_row(recording: Recording, queries: Array) -> Row:
    cloud = _cloud(recording)
    early = cloud.time_ns < START_NS + AFTER * NS_PER_S
    density = local_density(cloud.xyz[early], queries)
    return {
        DENSITY: float(density.mean()),
        SPARSE: float(np.quantile(density, 0.1)),
        RMS: surface_rms(cloud, recording.world) * 1e3,
    }


def _cloud(recording: Recording) -> Points:
    return points_of_log(near_beams(simulated_log(recording)), 'slerp', MIXED_PIXEL_ANGLE)


def _mark_fronts(rows: Sequence[Row]) -> None:
    for front, key in FRONTS.items():
        for row, best in zip(rows, on_front(rows, key, RMS), strict=True):
            row[front] = 'x' if best else ''


def _surface_points(scene: Scene) -> Array:
    """Return some points of the surfaces that the sensor sees, in its frame."""
    xyz = _cloud(_recording(scene, reference_nod())).xyz
    chosen: Array = xyz[np.random.default_rng(0).choice(len(xyz), QUERIES, replace=False)]
    return chosen
