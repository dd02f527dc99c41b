"""Scans whose angles contradict each other are named."""

import math
from types import SimpleNamespace

from nodlidar_assembler.plausibility.scan_angles import angles_in_doubt
import pytest


def scan(first, step, beams, last):
    return SimpleNamespace(
        angle_min=first, angle_increment=step, angle_max=last, ranges=[1.0] * beams
    )


STEP = math.tau / 1024


@pytest.mark.parametrize('off', [0.0, STEP, -STEP, 0.05, -0.05])
def test_angles_that_agree_to_a_step_or_a_degree_are_not_named(off):
    assert not angles_in_doubt(scan(-2.0, STEP, 682, -2.0 + 681 * STEP + off))
    assert not angles_in_doubt(scan(2.0, -STEP, 682, 2.0 - 681 * STEP + off))
    assert not angles_in_doubt(scan(0.0, STEP, 1, 0.0))


def test_a_wrong_sign_or_step_is_named_with_both_ends():
    end = -2.0 + 681 * STEP
    assert angles_in_doubt(scan(-2.0, -STEP, 682, end)) == (
        'the last beam of scans is at -6.18 rad by angle_min and angle_increment, but at 2.18 rad '
        'by angle_max: one of them is wrong'
    )
    assert angles_in_doubt(scan(-2.0, 1.05 * STEP, 682, end))
    assert angles_in_doubt(scan(-math.pi, -math.tau / 360, 360, math.pi))


@pytest.mark.parametrize('last', [math.nan, math.inf])
def test_an_angle_max_that_is_no_number_is_named_only_if_it_says_something(last):
    assert bool(angles_in_doubt(scan(-2.0, STEP, 682, last))) is math.isinf(last)
