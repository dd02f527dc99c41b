"""The delay of odometry, against clouds whose beams are deskewed by it one by one."""

import math

from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, Poses
from nodlidar_assembler.clouds.point_layout import DESKEWED_POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_mapper.tracking.odometry_delay import is_worth_setting, odometry_delay
import numpy as np
import pytest

S = 10**9
START_NS = 1_700_000_000 * S
SWEEP, BEAMS, SECONDS = 0.7, 800, 60.0
LENGTH, WIDTH, HEIGHT = 7.0, 5.0, 2.0  # of the room [m], in the middle of which the robot turns
SECOND = np.arange(0.0, SECONDS, 0.02)  # of odometry
STOP_AND_GO = np.where(SECOND % 8.0 < 3.0, np.sin(SECOND // 8.0), 0.0)  # turn rate [rad/s]
FAST = np.where(SECOND % 4.0 < 2.0, 2.0 * np.sin(SECOND // 4.0 + 1.0), 0.0)


def heading(rate, seconds):
    return np.interp(seconds, SECOND, np.cumsum(rate) * 0.02)


def walls(bearing, rng):
    """Return where beams end, and how high, in the frame of the room, (n, 3)."""
    ahead, left = np.cos(bearing), np.sin(bearing)
    distance = np.minimum(LENGTH / 2.0 / np.abs(ahead), WIDTH / 2.0 / np.abs(left))
    distance += rng.normal(0.0, 0.01, len(bearing))
    return np.stack([distance * ahead, distance * left, rng.uniform(0.0, HEIGHT, BEAMS)], axis=1)


def turned(points, angle):
    ahead, left, up = points.T
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * ahead - sin * left, sin * ahead + cos * left, up], axis=1)


def estimated(rate, delay, miscounted=1.0, drift=0.0, missing=slice(0), jump=0.0):
    """Return the estimate where odometry is late, and counts turns too far by a share.

    It drifts [rad/s], some clouds are missing, and it jumps ahead half way [m].
    """
    rng = np.random.default_rng(1)

    def counted(seconds):
        return miscounted * heading(rate, seconds - delay) + drift * seconds

    clouds = []
    for end in np.arange(1.0 + SWEEP, SECONDS - 1.0, SWEEP):
        seen = np.linspace(end - SWEEP, end, BEAMS)
        bearing = rng.uniform(-2.0, 2.0, BEAMS) + heading(rate, seen)
        in_robot = turned(walls(bearing, rng), -heading(rate, seen))
        deskewed = np.zeros(BEAMS, DESKEWED_POINT)
        deskewed['x'], deskewed['y'], deskewed['z'] = turned(
            in_robot, counted(seen) - counted(end)
        ).T
        times_ns = START_NS + np.round(seen * S).astype(np.int64)
        clouds.append(Points(times_ns, deskewed, stamp_ns=int(times_ns[-1])))
    kept = np.delete(np.arange(len(clouds)), missing)
    half = counted(SECOND) / 2.0
    ahead = np.where(SECOND > SECONDS / 2.0, jump, 0.0)
    nothing = np.zeros(len(SECOND))
    odometry = Odometry(
        START_NS + np.round(SECOND * S).astype(np.int64),
        Poses(
            np.stack([ahead, nothing, nothing], axis=1),
            np.stack([nothing, nothing, np.sin(half), np.cos(half)], axis=1),
        ),
    )
    return odometry_delay([clouds[k] for k in kept], odometry, OdometryConfig())


@pytest.mark.parametrize(('rate', 'delay'), [(STOP_AND_GO, 0.25), (FAST, -0.08), (FAST, 0.0)])
def test_it_is_found_however_fast_the_robot_turns(rate, delay):
    found, error = estimated(rate, delay)
    assert error < 0.01
    assert found == pytest.approx(delay, abs=3.0 * error + 0.002)


@pytest.mark.parametrize(('miscounted', 'drift'), [(1.1, 0.0), (1.0, 0.03)])
def test_it_is_found_however_turns_are_counted(miscounted, drift):
    found, error = estimated(STOP_AND_GO, 0.1, miscounted, drift)
    assert error < 0.015
    assert found == pytest.approx(0.1, abs=3.0 * error + 0.002)


def test_clouds_that_are_missing_and_a_jump_of_odometry_do_not_matter():
    found, error = estimated(STOP_AND_GO, 0.1, missing=slice(20, 30), jump=1.0)
    assert error < 0.01
    assert found == pytest.approx(0.1, abs=3.0 * error + 0.002)


@pytest.mark.parametrize('kept', [0, 1, 2, 5])
def test_a_few_clouds_do_not_show_it(kept):
    _, error = estimated(STOP_AND_GO, 0.1, missing=slice(kept, None))
    assert math.isinf(error)


@pytest.mark.parametrize('rate', [0.0, 1.5])
def test_a_steady_turn_does_not_show_it(rate):
    _, error = estimated(np.full(len(SECOND), rate), 0.1)
    assert error > 0.05


@pytest.mark.parametrize(
    ('delay', 'error', 'worth'),
    [
        (0.06, 0.02, True),
        (-0.06, 0.02, True),
        (0.04, 0.02, False),
        (0.14, 0.045, True),
        (0.02, 0.001, False),
        (0.3, 0.06, False),
        (0.0, math.inf, False),
    ],
)
def test_a_delay_is_named_if_it_is_large_and_sure(delay, error, worth):
    assert is_worth_setting(delay, error) == worth
