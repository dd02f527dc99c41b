"""The band of N_s to choose from."""

import math
import re

from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import PUBLISHED
import pytest


def test_the_band_is_all_odd_samples_of_the_useful_band():
    assert np.array_equal(samples_in_band(PUBLISHED), np.arange(1001, 8000, 2))


def test_speeds_bound_the_band():
    samples = samples_in_band(Task(), speed_min=2.0, speed_max=3.0)
    speeds = [Task().speed(n_s) for n_s in (samples[0], samples[-1])]
    assert speeds == pytest.approx([3.0, 2.0], rel=1e-3)
    assert speeds[0] <= 3.0
    assert speeds[1] >= 2.0
    assert np.all(np.gcd(samples, 1024) == 1)


@pytest.mark.parametrize(
    ('speeds', 'key'),
    [((3.0, 2.0), 'speed_max'), ((0.0, 1.0), 'speed_min'), ((math.nan, 1.0), 'speed_min'),
     ((None, math.inf), 'speed_max'), ((1e-9, 1.0), 'speed_min')],
)  # fmt: skip
def test_speeds_that_are_none_are_refused(speeds, key):
    with pytest.raises(ParameterError, match=key):
        samples_in_band(Task(), *speeds)


@pytest.mark.parametrize(
    ('speeds', 'said'),
    [
        (
            (100.0, None),
            "'speed_min' must be at most 12.55 rad/s, that of N_s = 1001, but is 100.0",
        ),
        (
            (None, 1e-4),
            "'speed_max' must be at least 1.572 rad/s, that of N_s = 7999, or speed_min",
        ),
        ((3.0, 2.0), "'speed_max' must be at least 3.002 rad/s, that of N_s = 4187"),
        (
            (1e6, 2e6),
            "'speed_min' must be at most 1.256e.04 rad/s, that of N_s = 1, but is 1000000",
        ),
        ((3.1416, 3.1417), "'speed_max' must be such that one N_s of 4000 to 4000 is coprime"),
    ],
)
def test_a_band_without_samples_names_a_limit_that_was_passed(speeds, said):
    with pytest.raises(ParameterError, match=said):
        samples_in_band(Task(), *speeds)


@pytest.mark.parametrize(
    ('speeds', 'key'), [((0.001, 0.0010001), 'speed_max'), ((0.0125, 0.0126), 'speed_min')]
)
def test_a_nod_too_slow_to_be_planned_names_the_speed(speeds, key):
    """A million samples of 97.66 us are 97.66 s, for 1.2272 rad."""
    with pytest.raises(ParameterError, match=f"'{key}' must be at least 0.01257 rad/s, for N_s"):
        samples_in_band(Task(), *speeds)


@pytest.mark.parametrize(
    ('task', 'speeds'),
    [
        (Task(), (100.0, None)),
        (Task(), (None, 0.05)),
        (Task(), (3.0, 2.0)),
        (Task(steps_per_revolution=65_536), (None, None)),
        (Task(scan_rate=2000.0), (None, None)),
        (Task(steps_per_revolution=30_030), (None, 0.1)),
    ],
)
def test_a_limit_that_is_named_is_allowed(task, speeds):
    with pytest.raises(ParameterError) as refusal:
        samples_in_band(task, *speeds)
    named = float(re.search(r'at (?:least|most) ([\d.e+]+) rad/s', refusal.value.limit)[1])
    given = dict(zip(('speed_min', 'speed_max'), speeds, strict=True)) | {refusal.value.key: named}
    if given['speed_min'] is not None and given['speed_max'] is not None:
        given = {refusal.value.key: named}
    assert len(samples_in_band(task, **given)) > 0


def test_a_fine_lidar_needs_a_lowest_speed_and_the_error_names_the_value():
    with pytest.raises(ParameterError, match=r"'speed_min' must be at least 3.046 rad/s.*is 1.57"):
        samples_in_band(Task(steps_per_revolution=65_536))
