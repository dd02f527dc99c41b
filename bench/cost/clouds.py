"""The cost of number types and of clouds per sweep: time, bytes, rounding, age of points."""

from array import array
from dataclasses import dataclass
from functools import partial
from typing import Any

from nodlidar_assembler.bags.sensor_log import outcomes, SensorLog
from nodlidar_assembler.clouds.geometry import Beams
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.point_layout import POINT
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_log
import numpy as np
from numpy.typing import NDArray

from bench.shared.reference import DEFAULT_N_S, simulated_room
from bench.shared.report import Row
from bench.shared.timing import interleaved

DURATION = 20.0
ROUNDS = 60
POINT_64 = np.dtype(
    [
        *((name, np.float64) for name in 'xyz'),
        *((name, POINT[name]) for name in ('intensity', 'time', 'ring')),
    ],
    align=True,
)
TITLE = f'Clouds: the room, {DURATION:.0f} s at N_s = {DEFAULT_N_S}, joint states at 62 Hz'


@dataclass(frozen=True, slots=True)
class Numbers:
    """Number type of the computation, and record of a point."""

    name: str
    computed: type[np.floating[Any]]
    point: np.dtype[np.void]


NUMBERS = (
    Numbers('transform in float64, points in float32', np.float64, POINT),
    Numbers('transform and points in float64', np.float64, POINT_64),
    Numbers('transform and points in float32', np.float32, POINT),
)


def results() -> list[Row]:
    """Return rows by number types, and rows by clouds per scan and per sweep."""
    log = simulated_log(simulated_room(DURATION))
    return [*_by_numbers(log), *_by_mode(log)]


def _by_numbers(log: SensorLog) -> list[Row]:
    pipeline = Pipeline(PipelineConfig())
    scan = log.scans[len(log.scans) // 2]
    assembled = pipeline.add_scan(scan, log.sample_ns, log.sample_pitch)
    given = assembled.beams, scan.ranges, assembled.pitch
    exact = _assembled(NUMBERS[1], *given)
    times = interleaved(
        {numbers.name: partial(_bytes, numbers, *given) for numbers in NUMBERS},
        ROUNDS,
    )
    return [
        {
            'clouds': numbers.name,
            'time per scan [us]': own * 1e6,
            'bytes per point': numbers.point.itemsize,
            'largest rounding [nm]': _rounding(_assembled(numbers, *given), exact) * 1e9,
        }
        for numbers, (own, _) in zip(NUMBERS, times, strict=True)
    ]


def _assembled(
    numbers: Numbers,
    beams: Beams,
    ranges: NDArray[np.float32],
    pitch: Array,
) -> NDArray[np.void]:
    """Return the points of a scan with given number types, by the formulas of assembly.place."""
    p = beams.direction.astype(numbers.computed) * ranges.astype(numbers.computed)
    p += beams.laser_pose.position[:, None].astype(numbers.computed)
    phi = pitch.astype(numbers.computed)
    cos, sin = np.cos(phi), np.sin(phi)
    data = np.zeros(len(ranges), numbers.point)
    data['x'], data['y'], data['z'] = p[0] * cos - p[2] * sin, p[1], p[0] * sin + p[2] * cos
    return data


def _bytes(
    numbers: Numbers,
    beams: Beams,
    ranges: NDArray[np.float32],
    pitch: Array,
) -> 'array[int]':
    """Return the same points as the bytes of a message."""
    message = array('B')
    message.frombytes(_assembled(numbers, beams, ranges, pitch).view(np.uint8).data)
    return message


def _rounding(data: NDArray[np.void], exact: NDArray[np.void]) -> float:
    off = [data[axis].astype(np.float64) - exact[axis] for axis in 'xyz']
    return float(np.max(np.linalg.norm(off, axis=0)))


def _by_mode(log: SensorLog) -> list[Row]:
    """Return the time per scan, and the age of points when their cloud is complete."""
    modes = ('scan', 'sweep')
    times = interleaved({mode: partial(_ages, log, mode) for mode in modes}, ROUNDS // 4)
    rows = []
    for mode, (own, _) in zip(modes, times, strict=True):
        ages = _ages(log, mode)
        rows.append(
            {
                'clouds': f'whole pipeline, one per {mode}',
                'time per scan [us]': own / len(log.scans) * 1e6,
                'clouds per second': len(ages) / DURATION,
                'points in a cloud': int(np.median([len(age) for age in ages])),
                'mean age of a point [ms]': float(np.mean(np.concatenate(ages))) * 1e3,
                'largest age [ms]': float(np.max(np.concatenate(ages))) * 1e3,
            }
        )
    return rows


def _ages(log: SensorLog, mode: str) -> list[Array]:
    """Return the age of each cloud's points when it is complete [s]."""
    ages = []
    for outcome in outcomes(log, PipelineConfig(cloud_mode=mode)):
        around = log.samples_around(outcome.scan.stamp_ns, outcome.scan.end_ns)
        now_ns = log.sample_ns[around.stop - 1]
        clouds = outcome.assembled.clouds if outcome.assembled is not None else []
        ages += [(now_ns - cloud.time_ns) / NS_PER_S for cloud in clouds]
    return ages
