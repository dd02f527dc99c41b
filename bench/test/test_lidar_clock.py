"""Stamps stay right over a wrap, resets and a warming quartz."""

import numpy as np

from bench.devices.lidar_clock import errors, Lidar, LINES, RESETS, WRAP_AT, WRAP_MS


def test_the_timer_wraps_when_it_should():
    lidar = Lidar(LINES['URG, USB'], 0, wrap_ms=5000.0)
    stamps = []
    for lidar.now in np.arange(3000.0, 7000.0, 100.0):
        stamps.append(lidar.stamp())
    assert (np.diff(stamps) < 0).sum() == 1
    assert max(stamps) > WRAP_MS - 200


def test_a_urg_keeps_half_a_millisecond_and_is_aligned_once_a_reset():
    assert 0.0 < WRAP_AT < 1.0 / (RESETS + 1)
    for seed in range(3):
        found, aligned = errors(LINES['URG, USB'], seed, 6e5)
        assert aligned == RESETS
        assert len(found) > 2000
        assert np.sqrt(np.mean(found**2)) < 0.5
