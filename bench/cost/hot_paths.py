"""What is computed over and over, timed against a yardstick, so that machines can be compared.

`python -m bench --compare` compares with the recorded times.
"""

from dataclasses import replace
from itertools import cycle

from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_common.arrays import Array
from nodlidar_common.scip import decode, encode
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_log, simulated_odometry
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import Feedback
import numpy as np

from bench.shared.reference import DRIVING, FULL_CIRCLE, simulated_room, STANDING, START_NS
from bench.shared.report import Row
from bench.shared.scans import odometry_for, samples_for
from bench.shared.timing import Action, interleaved

TITLE = 'What is computed over and over, and how often the yardstick fits into it'
ROUNDS = 60
# Without the filter of mixed pixels: all beams of the scan become points.
UNFILTERED = PipelineConfig(mixed_pixel_angle=0.0)
SCANS = slice(5, 25)  # in turn, as an estimator may learn from one to the next
SLOWER = 1.25  # a greater ratio to the recorded time is not noise
WHAT, TIME, IN_YARDSTICKS, SIZE = 'what', 'time [us]', 'yardsticks', 'numbers in the result'
VERDICT = f'slower if above {SLOWER}'


def results(rounds: int = ROUNDS) -> list[Row]:
    """Return the times of all actions, and the sizes of their results."""
    paths = hot_paths()
    times = interleaved(paths, rounds)
    return [
        {
            WHAT: name,
            TIME: own * 1e6,
            IN_YARDSTICKS: own / beside,
            SIZE: np.asarray(action()).size,
        }
        for (name, action), (own, beside) in zip(paths.items(), times, strict=True)
    ]


def comparison(rows: list[Row], before: list[Row]) -> list[Row]:
    """Return the ratio of each time to the time of the same name before, both in yardsticks."""
    known = {row[WHAT]: row[IN_YARDSTICKS] for row in before}
    return [
        {
            WHAT: row[WHAT],
            'recorded [yardsticks]': known[row[WHAT]],
            'now [yardsticks]': row[IN_YARDSTICKS],
            'ratio': (ratio := row[IN_YARDSTICKS] / known[row[WHAT]]),
            VERDICT: 'slower' if ratio > SLOWER else '',
        }
        for row in rows
        if row[WHAT] in known
    ]


def hot_paths() -> dict[str, Action]:
    """Return the timed actions by name."""
    return {
        **{f'scan to points, {name}': _scan_action(name, False) for name in ESTIMATORS},
        'scan to points, slerp, per-beam odometry': _scan_action('slerp', True),
        **_message_and_coverage(),
        'decoding the 682 ranges of a scan': _decoding(),
        'simulation of a second, with its start': _simulation,
        'choice of N_s': lambda: quick_choice(FULL_CIRCLE, samples_in_band(Task())[::50], 0.0),
        'choice of the next sweep': _next_sweep(),
    }


def _scan_action(estimator: str, moving: bool) -> Action:
    simulated = simulated_room(3.0, velocity=DRIVING if moving else STANDING)
    config = replace(UNFILTERED, estimator=estimator)
    log, pipeline = simulated_log(simulated), Pipeline(config)
    known = simulated_odometry(simulated)
    inputs = [
        (scan, *samples_for(scan, log, pipeline), odometry_for(scan, known) if moving else None)
        for scan in log.scans[SCANS]
    ]
    turns = cycle(inputs)
    return lambda: pipeline.add_scan(*next(turns)).clouds[0].data


def _message_and_coverage() -> dict[str, Action]:
    simulated = simulated_room(12.0)
    log = simulated_log(simulated)
    pipeline = Pipeline(UNFILTERED)
    scan = log.scans[10]
    assembled = pipeline.add_scan(scan, log.sample_ns, log.sample_pitch)
    [points] = assembled.clouds
    monitor, scans = CoverageMonitor(AssemblerConfig()), iter(range(10**9))

    def cover() -> None:
        k = next(scans)
        later = replace(scan, stamp_ns=START_NS + k * NS_PER_S // 10)
        pitch = simulated.true_pitch[k % len(log.scans)]
        monitor.add(replace(assembled, scan=later, pitch=pitch))

    for _ in range(100):  # fills the window
        cover()
    return {
        'points to message': lambda: cloud_message(points, 'frame').data,
        'coverage of a scan': cover,
    }


def _decoding() -> Action:
    data = encode(np.arange(682) * 8, 3)
    return lambda: decode(data, 3)


def _simulation() -> Array:
    return simulated_room(1.0).ranges


def _next_sweep() -> Action:
    feedback = Feedback(FULL_CIRCLE, 2500, 0.003)
    return lambda: feedback.next_duration(-0.5, True)
