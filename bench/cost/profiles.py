"""Cost and accuracy of each profile in the room: with the errors of real devices, and ideal.

Computation is the work on arrays, from scans and joint samples to the cloud message and the
observed coverage. Callbacks are those of the real node, publishing included, without the time in
which rclpy receives messages. `python -m bench live` includes that and the other nodes.
"""

from dataclasses import dataclass
from functools import partial

from nodlidar_assembler.bags.sensor_log import assemble_log, SensorLog
from nodlidar_assembler.clouds.pipeline import Pipeline
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from nodlidar_assembler.profiles import PROFILES
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_demo.evaluation import FAR, near_beams, surface_rms
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import Recording
import numpy as np

from bench.cost.replay import messages_of, times_per_scan
from bench.errors.accuracy import pitch_rms
from bench.shared.reference import (
    DEFAULT_N_S,
    FEEDBACK_RATE,
    joints_at,
    real_room,
    REFERENCE_N_S,
    simulated_room,
)
from bench.shared.report import Row
from bench.shared.scans import latency, samples_for
from bench.shared.timing import interleaved

DURATION = 20.0
ROUNDS = 7
SCANS_PER_S = 10
BALANCED = 'balanced'
ERROR, COMPUTATION = 'distance to balanced', 'computation to balanced'
DISTANCE, IDEAL = 'RMS distance, devices with errors [mm]', 'RMS distance, ideal devices [mm]'
FASTER = 'the same at pi rad/s [mm]'
SEEDS = range(6)
TITLE = (
    f'Profiles: the room, {DURATION:.0f} s at N_s = {DEFAULT_N_S}, the default, or '
    f'{REFERENCE_N_S}, pi rad/s; URG-04LX-UG01 on an RX-24F, means of {len(SEEDS)} '
    f'runs, or ideal devices; distance to the surfaces, beams up to {FAR:g} m'
)


@dataclass(frozen=True, slots=True)
class Found:
    """RMS distance to the surfaces with real and ideal devices [m], latency, times per scan [s].

    `pitch` is the RMS error of pitch with real devices [rad], `faster` as `surface` at pi rad/s.
    """

    pitch: float
    surface: float
    faster: float
    ideal: float
    latency: float
    computation: float
    callbacks: float


def results(rounds: int = ROUNDS) -> list[Row]:
    """Return errors, latency and times of each profile, and their ratios to balanced."""
    sensors = {name: joints_at(rate) for name, rate in FEEDBACK_RATE.items()}
    recordings = {name: real_room(DURATION, sensor) for name, sensor in sensors.items()}
    ideal = {name: simulated_room(DURATION, sensor=sensor) for name, sensor in sensors.items()}
    computation = computation_times(recordings, rounds)
    callbacks = callback_times(recordings, rounds)
    found = {
        name: Found(
            pitch_rms(recordings[name], Pipeline(config).estimator),
            mean_rms(name, DEFAULT_N_S),
            mean_rms(name, REFERENCE_N_S),
            _surface_rms(ideal[name], config),
            latency(simulated_log(recordings[name]), Pipeline(config)),
            computation[name],
            callbacks[name],
        )
        for name, config in ((name, PROFILES[name]) for name in FEEDBACK_RATE)
    }
    return [_row(name, own, found[BALANCED]) for name, own in found.items()]


def _row(name: str, own: Found, balanced: Found) -> Row:
    return {
        'profile': name,
        'joint states [Hz]': FEEDBACK_RATE[name],
        'RMS pitch error [mrad]': own.pitch * 1e3,
        DISTANCE: own.surface * 1e3,
        FASTER: own.faster * 1e3,
        ERROR: own.surface / balanced.surface,
        IDEAL: own.ideal * 1e3,
        'latency after the last beam [ms]': own.latency * 1e3,
        'computation per scan [us]': own.computation * 1e6,
        COMPUTATION: own.computation / balanced.computation,
        'callbacks per scan [us]': own.callbacks * 1e6,
        'callbacks to balanced': own.callbacks / balanced.callbacks,
    }


def mean_rms(profile: str, samples_per_sweep: int, seeds: range = SEEDS) -> float:
    """Return the mean of several runs' RMS distance to the surfaces, with real devices [m]."""
    sensor = joints_at(FEEDBACK_RATE[profile])
    runs = (
        real_room(DURATION, sensor, seed=seed, samples_per_sweep=samples_per_sweep)
        for seed in seeds
    )
    return float(np.mean([_surface_rms(run, PROFILES[profile]) for run in runs]))


def _surface_rms(simulated: Recording, config: AssemblerConfig) -> float:
    clouds, _ = assemble_log(near_beams(simulated_log(simulated)), config)
    squares = [surface_rms(cloud, simulated.world) ** 2 * len(cloud.data) for cloud in clouds]
    return float(np.sqrt(sum(squares) / sum(len(cloud.data) for cloud in clouds)))


def computation_times(recordings: dict[str, Recording], rounds: int) -> dict[str, float]:
    """Return the time of all computation per scan [s]."""
    logs = {name: simulated_log(simulated) for name, simulated in recordings.items()}
    actions = {name: partial(_compute, log, PROFILES[name]) for name, log in logs.items()}
    times = interleaved(actions, rounds)
    return {
        name: own / len(log.scans)
        for (name, log), (own, _) in zip(logs.items(), times, strict=True)
    }


def _compute(log: SensorLog, config: AssemblerConfig) -> None:
    """Process the arrays of a log as the node does."""
    pipeline = Pipeline(config)
    monitor = CoverageMonitor(config) if config.coverage_window > 0.0 else None
    for k, scan in enumerate(log.scans[3:-3]):
        assembled = pipeline.add_scan(scan, *samples_for(scan, log, pipeline))
        for cloud in assembled.clouds:
            cloud_message(cloud, config.frame_id)
        if monitor is not None:
            monitor.add(assembled)
            if k % SCANS_PER_S == 0:
                monitor.covered()


def callback_times(recordings: dict[str, Recording], rounds: int) -> dict[str, float]:
    """Return the time that the node's callbacks take per scan [s]."""
    messages = {name: messages_of(simulated_log(r)) for name, r in recordings.items()}
    replays = {name: ([f'profile:={name}'], m) for name, m in messages.items()}
    return times_per_scan(replays, rounds)
