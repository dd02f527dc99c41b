"""The error budget against the simulator, in set-ups drawn at random.

The error of a point is its displacement from the true end of its beam: no surface hides a part of
it. Beams whose spots cover an edge do not count, since the budget has no mixed pixels; lost beams
have no points.
"""

from dataclasses import replace
import math
from typing import Any

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.arrays import Mask
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.error_budget.budget import Beams, beams_at, budget_of, ErrorBudget
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.error_budget.swing import Swing
from nodlidar_planner.pattern.task import Task
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.servo.encoder import Encoder
import numpy as np

from bench.errors.budget_setups import drawn_setup, SetUp
from bench.errors.simulated_error import COOL_DOWN, estimate_rms, IN_CLOUD, simulated_rms, WARM_UP
from bench.shared.reference import FEEDBACK_RATE, START_NS
from bench.shared.report import Row
from bench.shared.rms import rms

DURATION = 6.0
SETUPS = 20
GRAVITY = 9.81  # m/s2
ON_EDGE = 2e-3  # difference of range by which a spot covers an edge [m]
EXACT = ('mount_position_error', 'mount_angle_error', 'joint_delay_error', 'scan_delay_error')
# What is left of an RX-24F's encoder with its zero calibrated: the deviation from its mean.
CALIBRATED = {**dict.fromkeys(EXACT, 0.0), 'encoder_error': 0.0016}
LIDARS: dict[str, dict[str, float]] = {
    'URG-04LX-UG01': {},
    'noise of 1 mm': {'range_noise': 0.001, 'range_noise_growth': 0.0, 'range_bias': 0.0},
}
CHOICES: dict[str, dict[str, Any]] = {
    '`fast`': {'joint_rate': FEEDBACK_RATE['fast']},
    '`balanced`': {'joint_rate': FEEDBACK_RATE['balanced']},
    'with `trajectory`': {'joint_rate': FEEDBACK_RATE['balanced'], 'estimator': 'trajectory'},
}
DISTANCES = (1.0, 2.0, 3.0, 4.0)
RATIO = 'budget to simulated'
RATIO_WITHOUT_LIDAR = 'the same without errors of the lidar'
RATIO_OF_PITCH = 'the same of the pitch estimate alone'
TITLE = (
    f'The error budget in {SETUPS} set-ups drawn at random, {DURATION:.0f} s each: RMS '
    'displacement of the points from the true ends of their beams, without mixed pixels'
)


def results() -> list[Row]:
    """Return a row per set-up, and the budgets of the profiles."""
    return [*(row_of(drawn_setup(seed)) for seed in range(SETUPS)), *profile_rows()]


def profile_rows() -> list[Row]:
    """Return the budgets of the profiles with the default nod, calibrated."""
    return [
        {
            'lidar': lidar,
            'choice': choice,
            'joint states [Hz]': values['joint_rate'],
            **_expected(ErrorParameters(**noise, **values, **CALIBRATED)),  # type: ignore[arg-type]
        }
        for lidar, noise in LIDARS.items()
        for choice, values in CHOICES.items()
    ]


def _expected(parameters: ErrorParameters) -> Row:
    """Return the error of the pitch, and of points at some distances."""
    task, nod = Task(), NodConfig()
    budget = budget_of(task, task.speed(nod.samples_per_sweep), parameters)
    at = {d: budget.rms(beams_at(task, d))['total'] * 1e3 for d in DISTANCES}
    pitch = math.sqrt(budget.pitch_variance) * 1e3
    return {'pitch estimate [mrad]': pitch, **{f'at {d:g} m [mm]': at[d] for d in DISTANCES}}


def row_of(setup: SetUp, duration: float = DURATION) -> Row:
    """Return the budget and the simulated error of a set-up, of a recording [s]."""
    seen = simulate(
        setup.scene, setup.nod, duration, setup.seed, start_ns=START_NS, sensor=setup.sensor
    )
    chosen = _chosen(seen, setup)
    parameters = _parameters(seen, setup, chosen)
    expected = budget(setup, parameters).rms(_beams(seen, chosen))
    simulated, without_lidar = simulated_rms(seen, setup, parameters, chosen)
    of_pitch = estimate_rms(seen, parameters, chosen)
    of_lidar = math.hypot(expected['range noise'], expected['range bias'])
    rest = math.sqrt(expected['total'] ** 2 - of_lidar**2)
    return {
        'scene': setup.scene.name,
        'beams up to [m]': float(seen.true_range[chosen].max()),
        'speed [rad/s]': setup.nod.speed,
        'servo': 'rx24f' if setup.scene.servo else 'ideal',
        'encoder [mrad]': parameters.encoder_step * 1e3,
        'joint states [Hz]': parameters.joint_rate,
        'estimator': parameters.estimator,
        'lidar': setup.lidar,
        'robot [m/s]': parameters.robot_speed,
        'budget [mm]': expected['total'] * 1e3,
        'simulated [mm]': simulated * 1e3,
        RATIO: expected['total'] / simulated,
        RATIO_WITHOUT_LIDAR: rest / without_lidar,
        RATIO_OF_PITCH: expected['pitch estimate'] / of_pitch,
    }


def budget(setup: SetUp, parameters: ErrorParameters) -> ErrorBudget:
    """Return the budget of a set-up."""
    nod = setup.nod
    swing = Swing(nod.speed, nod.sweep_duration, parameters.reversal_acceleration)
    return ErrorBudget(parameters, swing)


def _parameters(seen: Recording, setup: SetUp, chosen: Mask) -> ErrorParameters:
    """Return the data of a set-up, completed by those of its surfaces, servo and robot."""
    v, w = setup.scene.base_velocity
    of_velocity = OdometryUncertainty(setup.scene.effects).of_velocity(np.array([v, 0.0, w]))
    scan = (len(seen.azimuth) - 1) * seen.sensor.time_increment
    return replace(
        setup.given,
        range_bias=_range_bias(seen, setup.scene.lidar, chosen),
        encoder_error=_encoder_error(setup),
        deflection=_deflection(setup),
        laser_above=setup.scene.optical_offset,
        odometry_speed_error=math.sqrt(of_velocity[0, 0]),
        odometry_turn_error=math.sqrt(of_velocity[2, 2]),
        cloud_time=(IN_CLOUD - 1) * seen.sensor.scan_time + scan,
    )


def _range_bias(seen: Recording, lidar: LidarParameters, chosen: Mask) -> float:
    """Return the RMS bias [m] of a lidar on the surfaces that the beams hit."""
    times_ns = seen.true_time_ns[chosen]
    rays = seen.world.rays(times_ns, np.broadcast_to(seen.azimuth, chosen.shape)[chosen])
    hit = seen.world.echoes(*rays, times_ns)
    bias = lidar.bias(hit.brightness, hit.cosine)
    bias += lidar.drift((times_ns - START_NS) / NS_PER_S)
    return rms(bias)


def _encoder_error(setup: SetUp) -> float:
    """Return the RMS smooth error [rad] of the servo's encoder, between the limits."""
    if setup.scene.servo is None:
        return 0.0
    pitch = np.linspace(setup.nod.pitch_min, setup.nod.pitch_max, 200)
    seeds = np.random.SeedSequence(setup.seed).generate_state(4)
    return rms(Encoder(setup.scene.servo, int(seeds[1])).smooth(pitch) - pitch)


def _deflection(setup: SetUp) -> float:
    """Return the RMS deflection [rad] of gear and bracket by the lidar's weight and inertia."""
    servo, nod = setup.scene.servo, setup.nod
    if servo is None:
        return 0.0
    pitch = np.linspace(nod.pitch_min, nod.pitch_max, 200)
    weight = servo.load_mass * GRAVITY * servo.load_height * rms(np.sin(pitch))
    swing = Swing(nod.speed, nod.sweep_duration, setup.given.reversal_acceleration)
    reversing = math.sqrt(swing.reversal_time / nod.sweep_duration)
    inertia = servo.lidar_inertia * swing.acceleration * reversing
    return math.hypot(weight, inertia) / servo.stiffness


def _chosen(seen: Recording, setup: SetUp) -> Mask:
    """Return which beams count: measured, near enough, not on an edge; (scans, beams)."""
    spot = Lidar(LidarParameters(divergence=setup.scene.lidar.divergence), seen.world, START_NS, 0)
    azimuth = np.tile(seen.azimuth, len(seen.ranges))
    ranges = spot.ranges(seen.true_time_ns.ravel(), azimuth).reshape(seen.ranges.shape)
    with np.errstate(invalid='ignore'):
        chosen = np.abs(ranges - seen.true_range) < ON_EDGE
    sensor = seen.sensor
    chosen &= np.isfinite(seen.ranges) & (seen.true_range < sensor.range_max)
    chosen &= seen.true_range > sensor.range_min
    chosen[:WARM_UP] = chosen[-COOL_DOWN:] = False
    farthest = np.quantile(seen.true_range[chosen], setup.share)
    return np.asarray(chosen & (seen.true_range <= farthest))


def _beams(seen: Recording, chosen: Mask) -> Beams:
    azimuth = np.broadcast_to(seen.azimuth, chosen.shape)[chosen]
    return Beams(seen.true_range[chosen], azimuth, seen.true_pitch[chosen])
