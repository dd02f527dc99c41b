"""Cells seen by lidars whose beams per revolution are not whole, or drift, by enumeration."""

import math

from nodlidar_common.arrays import Array
import numpy as np

from bench.shared.report import Row

TITLE = 'Share of cells of 1 degree seen by a lidar of 360 degrees, 4500 beams per second, 10 Hz'
RATE, BEAMS = 10.0, 4500.0  # revolutions and beams per second
SPAN = 0.8  # rad
CELL = math.radians(1.0)
DURATIONS = (5.0, 10.0, 20.0)  # s
STEADY, NOT_WHOLE, DRIFTS = '450, steady', '450.37, steady', '450, speed drifts by 1 %'
N_L = 449  # 2 pi by the step that drivers publish: the last beam repeats the first direction
SAMPLES = (5 * N_L, 5 * N_L + 1, 3309)  # the last one is what the node chooses


def results() -> list[Row]:
    """Return the share of the cells seen for each lidar and N_s."""
    return [
        {'beams per revolution': name, 'N_s': n_s, 'gcd with N_L': math.gcd(n_s, N_L)}
        | {f'after {time:g} s [%]': 100.0 * seen(name, n_s, time) for time in DURATIONS}
        for name in (STEADY, NOT_WHOLE, DRIFTS)
        for n_s in SAMPLES
    ]


def seen(name: str, samples_per_sweep: int, duration: float) -> float:
    """Return the share of the cells that beams hit in a duration [s].

    The nod follows the revolutions, as the node's: a sweep takes N_s / N_L of them.
    """
    turned = revolutions(name, (np.arange(round(duration * BEAMS)) + 0.5) / BEAMS)
    place = np.mod(turned * N_L / samples_per_sweep, 2.0)
    pitch = SPAN * (1.0 - np.abs(1.0 - place))
    rows = math.floor(SPAN / CELL)
    row, column = np.floor(pitch / SPAN * rows), np.floor(np.mod(turned, 1.0) * 360.0)
    return len(np.unique(row * 360 + column)) / (rows * 360)


def revolutions(name: str, time: Array) -> Array:
    """Return the revolutions since the start at each time [s]."""
    if name == NOT_WHOLE:
        return time * (BEAMS / 450.37)
    if name == DRIFTS:  # within 7 s, as a controlled motor does
        time = time + 0.01 * 7.0 / math.tau * np.sin(math.tau * time / 7.0)
    return RATE * time
