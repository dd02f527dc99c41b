"""The cost of each stage of the node that is in use.

Ego-motion is measured with the estimators (`python -m bench estimators`).
"""

from dataclasses import replace

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np

from bench.cost.replay import messages_of, times_per_scan
from bench.shared.reference import simulated_room
from bench.shared.report import Row

DURATION = 20.0
ROUNDS = 7
JOINT_RATE = 100.0
TITLE = (
    f'Stages of the node: time in callbacks, {JOINT_RATE:.0f} joint states and 10 scans a second'
)
ALONE, COMMANDED = 'clouds alone', 'nod commanded'
OFF = ['command_nod:=false', 'coverage_window:=0.0']
# The stage that it is added to, and the parameters of both.
STAGES = {
    ALONE: (ALONE, OFF),
    'intensities': (ALONE, OFF),
    'clouds per sweep': (ALONE, [*OFF, 'cloud_mode:=sweep']),
    'estimator trajectory': (ALONE, [*OFF, 'estimator:=trajectory']),
    'coverage': (ALONE, OFF[:1]),
    COMMANDED: (ALONE, OFF[1:]),
    'limits adapted': (COMMANDED, [*OFF[1:], 'adapt_limits:=true']),
    'sweeps chosen by feedback': (COMMANDED, [*OFF[1:], 'nod_mode:=feedback']),
}


def results() -> list[Row]:
    """Return the time per scan with each stage, and the share of the stage."""
    log = simulated_log(simulated_room(DURATION, sensor=SensorModel(joint_rate=JOINT_RATE)))
    plain, bright = messages_of(log), messages_of(_with_intensities(log))
    replays = {
        name: (given, bright if name == 'intensities' else plain)
        for name, (_, given) in STAGES.items()
    }
    times = times_per_scan(replays, ROUNDS)
    return [
        {
            'stage': name,
            'stands on': base if base != name else '',
            'callbacks per scan [us]': times[name] * 1e6,
            'of that its own [us]': (times[name] - times[base]) * 1e6 if base != name else None,
        }
        for name, (base, _) in STAGES.items()
    ]


def _with_intensities(log: SensorLog) -> SensorLog:
    bright = np.ones(len(log.scans[0].ranges), dtype=np.float32)
    return replace(log, scans=[replace(scan, intensities=bright) for scan in log.scans])
