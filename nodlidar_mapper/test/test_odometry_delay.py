"""The delay of odometry, against clouds whose beams are deskewed by it one by one."""

import math

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.points import DESKEWED_POINT
from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.tracking.odometry_delay import is_worth_setting, odometry_delay
import numpy as np
import pytest

S = 10**9
START_NS = 1_700_000_000 * S
SWEEP, BEAMS, SECONDS = 0.7, 200, 60.0
SECOND = np.arange(0.0, SECONDS, 0.02)  # of odometry
STOP_AND_GO = np.where(SECOND % 8.0 < 3.0, np.sin(SECOND // 8.0), 0.0)  # turn rate [rad/s]


def heading(rate, seconds):
    return np.interp(seconds, SECOND, np.cumsum(rate) * 0.02)


def estimated(rate, delay, miscounted=1.0, wrong=(), missing=slice(0)):
    """Return the estimate where odometry is late, and counts turns too far by a share."""
    rng = np.random.default_rng(1)

    def counted(seconds):
        return miscounted * heading(rate, seconds - delay)

    clouds, poses = [], []
    for end in np.arange(1.0 + SWEEP, SECONDS - 1.0, SWEEP):
        seen = np.linspace(end - SWEEP, end, BEAMS)
        bearing = rng.uniform(-1.0, 1.0, BEAMS)  # of the beams' ends in the world
        deskewed = bearing - heading(rate, seen) - (counted(end) - counted(seen))
        matched = np.median(bearing - deskewed) + rng.normal(0.0, 0.001)
        poses.append(planar(0.0, 0.0, matched))
        times_ns = START_NS + np.round(seen * S).astype(np.int64)
        stamp_ns = int(times_ns[-1])
        clouds.append(Points(times_ns, np.zeros(BEAMS, DESKEWED_POINT), stamp_ns=stamp_ns))
    believed = np.ones(len(clouds), dtype=bool)
    for k in filter(lambda k: k < len(clouds), wrong):
        poses[k], believed[k] = poses[k] @ planar(0.0, 0.0, 1.0), False
    kept = np.delete(np.arange(len(clouds)), missing)
    clouds = [clouds[k] for k in kept]
    half = counted(SECOND) / 2.0
    turned = np.stack([0.0 * half, 0.0 * half, np.sin(half), np.cos(half)], axis=1)
    times_ns = START_NS + np.round(SECOND * S).astype(np.int64)
    odometry = Odometry(times_ns, Poses(np.zeros((len(SECOND), 3)), turned))
    return odometry_delay(clouds, np.stack(poses)[kept], believed[kept], odometry)


@pytest.mark.parametrize('delay', [-0.08, 0.0, 0.05, 0.2])
@pytest.mark.parametrize('miscounted', [0.9, 1.0, 1.1])
def test_it_is_found_however_turns_are_counted(delay, miscounted):
    found, error = estimated(STOP_AND_GO, delay, miscounted)
    assert error < 0.002
    assert found == pytest.approx(delay, abs=4.0 * error + 0.001)


def test_clouds_that_are_not_believed_do_not_count():
    found, error = estimated(STOP_AND_GO, 0.1, wrong=(10, 30, 31))
    assert error < 0.002
    assert found == pytest.approx(0.1, abs=4.0 * error + 0.001)


def test_a_robot_that_turns_round_where_clouds_are_missing_shows_it_as_well():
    found, error = estimated(STOP_AND_GO, 0.1, missing=slice(20, 40))
    assert error < 0.003
    assert found == pytest.approx(0.1, abs=4.0 * error + 0.001)


@pytest.mark.parametrize('believed', [0, 1, 2, 5])
def test_a_few_clouds_do_not_show_it(believed):
    _, error = estimated(STOP_AND_GO, 0.1, wrong=range(believed, 80))
    assert math.isinf(error)


@pytest.mark.parametrize('rate', [0.0, 0.5])
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
