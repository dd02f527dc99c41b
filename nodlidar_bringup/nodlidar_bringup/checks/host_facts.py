"""Reads clocks and processor of this computer."""

import ctypes
import os
from pathlib import Path
import time

from nodlidar_bringup.checks.host import Host
from nodlidar_common.arrays import Array
import numpy as np

CPU_FREQUENCY = Path('/sys/devices/system/cpu/cpu0/cpufreq')
_TIMEX_BYTES = 256  # struct timex of Linux has 208
_TIME_ERROR = 5  # adjtimex(2): the clock is not synchronised
_RUNS = 25


class HostWatch:
    """Watches the computer from construction until `facts`."""

    def __init__(self) -> None:
        self._offset_ns = _clock_offset_ns()
        self._ticks = _processor_ticks()
        self._yardstick = yardstick()

    def facts(self, nodes_run: bool) -> Host:
        """Return what was seen since construction.

        Parameters
        ----------
        nodes_run
            Whether the sensor's nodes were running.
        """
        return Host(
            time.time_ns(),
            clock_is_synchronised(),
            (_clock_offset_ns() - self._offset_ns) * 1e-9,
            len(os.sched_getaffinity(0)),
            _busy_share(self._ticks, _processor_ticks()),
            self._yardstick,
            _of_frequency('governor'),
            _of_frequency('driver'),
            nodes_run,
        )


def clock_is_synchronised() -> bool | None:
    """Return whether the kernel takes its clock for synchronised (adjtimex(2)); None if unknown.

    Chrony, ntpd, systemd-timesyncd and ptp's phc2sys all report to the kernel.
    """
    try:
        state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    except (OSError, AttributeError):
        return None
    return None if state < 0 else state != _TIME_ERROR


def yardstick() -> float:
    """Return the time that a fixed piece of NumPy takes, the least of some runs [s].

    It places the beams of a few scans, as the assembler does.
    """
    angles = np.linspace(-2.0, 2.0, 682 * 16)
    return min(_time_of(angles) for _ in range(_RUNS))


def _time_of(angles: Array) -> float:
    begin = time.perf_counter()
    for _ in range(4):
        cos, sin = np.cos(angles), np.sin(angles)
        np.stack([cos * cos - 0.08 * sin, sin, cos * sin + 0.08 * cos])
    return time.perf_counter() - begin


def _clock_offset_ns() -> int:
    """Return the system clock less the monotonic one, which nobody sets [ns].

    A service slews both alike. The raw one is not slewed: against it, 500 ppm would be a step.
    """
    before = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
    now = time.time_ns()
    after = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
    return now - (before + after) // 2


def _processor_ticks() -> tuple[int, int]:
    """Return the ticks that all cores were idle, and all ticks (proc(5), /proc/stat)."""
    numbers = [int(word) for word in Path('/proc/stat').read_text().split('\n')[0].split()[1:9]]
    return numbers[3] + numbers[4], sum(numbers)


def _busy_share(before: tuple[int, int], after: tuple[int, int]) -> float:
    idle, all_ticks = after[0] - before[0], after[1] - before[1]
    return 1.0 - idle / all_ticks if all_ticks else 0.0


def _of_frequency(what: str) -> str:
    try:
        return (CPU_FREQUENCY / f'scaling_{what}').read_text().strip()
    except OSError:
        return ''
