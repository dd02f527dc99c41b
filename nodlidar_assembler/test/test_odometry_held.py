"""Odometry that is sent more often than it is measured."""

import math
import re

from hypothesis import assume, given
from hypothesis import strategies as st
from nodlidar_assembler.plausibility.odometry_held import held_poses
import numpy as np
import pytest


def warning_of(way, turn=lambda t: 0.0, sent=50.0, measured=10.0, duration=5.0):
    """Return the warning about odometry of a way [m] and a turn [rad] at times [s], at rates."""
    times = np.arange(round(duration * sent)) / sent
    at = (np.floor(times * measured + 1e-9) / measured).tolist()
    position = np.array([(way(t), 0.0, 0.0) for t in at])
    half_turn = [turn(t) / 2.0 for t in at]
    orientation = np.array([(0.0, 0.0, math.sin(half), math.cos(half)) for half in half_turn])
    return held_poses(np.rint(times * 1e9).astype(np.int64), position, orientation)


@given(st.sampled_from([20.0, 50.0, 100.0]), st.integers(2, 8), st.floats(0.3, 2.0), st.booleans())
def test_a_pose_that_is_held_is_named_with_its_error(sent, times, speed, backwards):
    measured = sent / times
    assume(measured >= 4.0)
    sign = -1.0 if backwards else 1.0
    found = warning_of(lambda t: sign * speed * t, sent=sent, measured=measured)
    error = speed / measured
    if error < 0.0099:
        assert found == ''
    elif error > 0.0101:
        expected = f'every {1e3 / sent:.0f} ms, but changes every {1e3 / measured:.0f} ms'
        assert expected in found
        stated = int(re.search(r'up to (\d+) mm off', found)[1])
        assert stated == pytest.approx(error * 1e3, abs=0.51)


def test_a_turn_on_the_spot_counts_at_the_distance_of_the_points():
    assert 'points 2 m away are up to 100 mm off' in warning_of(lambda t: 0.0, lambda t: 0.5 * t)


@pytest.mark.parametrize(
    'way',
    [
        lambda t: 0.0,
        lambda t: 0.3 * max(t - 4.6, 0.0),  # it has just begun to move
        lambda t: 0.3 * min(t, 0.4),
        lambda t: 0.001 * math.floor(t * 40.0),  # a crawl by steps of an encoder
        lambda t: 0.5 * math.floor(t),  # it moves now and then
    ],
)
def test_a_robot_that_stands_or_crawls_holds_no_pose(way):
    assert warning_of(way) == ''


def test_odometry_as_fast_as_its_stamps_is_right():
    assert warning_of(lambda t: 1.0 * t, measured=50.0) == ''
