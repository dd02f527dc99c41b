"""Scans that repeat the ranges of another pitch."""

import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.repeats import RepeatCheck, RepeatedScanError
import numpy as np
import pytest

STEP = math.tau / 1024
GEOMETRY = ScanGeometry(300, -1.0, STEP, 1e-4, 0.02, 5.6)
RANGES = np.linspace(1.0, 2.0, 300).astype(np.float32)


def dropped(pitches, ranges=lambda k: RANGES):
    """Return the numbers of the scans that are dropped, each at one pitch."""
    check, numbers = RepeatCheck(), []
    for k, pitch in enumerate(pitches):
        try:
            check.check(GEOMETRY, ranges(k), np.full(300, pitch))
        except RepeatedScanError:
            numbers.append(k)
    return numbers


@pytest.mark.parametrize('step', [0.2, 0.02, 0.004])
def test_a_driver_that_hangs_while_the_lidar_nods_is_dropped_for_good(step):
    pitches = step * np.arange(60)
    assert dropped(pitches) == [k for k in range(60) if pitches[k] > STEP]


def test_a_lidar_that_rests_elsewhere_than_it_was_estimated_is_heard_after_a_second():
    assert dropped([0.0] + [3.0 * STEP] * 30) == list(range(1, 11))


def test_a_lidar_that_rests_is_heard():
    assert dropped([0.3] * 30) == []


def test_other_ranges_are_of_a_driver_that_works():
    assert dropped(0.2 * np.arange(20), lambda k: RANGES + np.float32(k) * 1e-6) == []
