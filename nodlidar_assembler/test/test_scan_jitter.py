"""Stamps of scans that jitter are named with the error of points, and no others."""

import re

from nodlidar_assembler.plausibility.scan_jitter import ScanJitter
from nodlidar_common.nod import Nod
import numpy as np
import pytest

START_NS = 1_700_000_000 * 10**9
NOD = Nod(-0.6, 0.6, 0.74, 7547, START_NS)


def warning(off, kept=None, nominal=0.1, nod=NOD, speed=1.0, period=0.1):
    """Return the warning for scans of which some are kept, with stamps that are off [s].

    The lidar turns at a share of its speed, a number or one for each scan.
    """
    jitter = ScanJitter()
    begins = np.cumsum(np.full(len(off), period) / speed)
    for k in np.arange(len(off)) if kept is None else np.flatnonzero(kept):
        truth_ns = START_NS + round(begins[k] * 1e9)
        jitter.add(truth_ns + round(off[k] * 1e9), nominal, float(nod.pitch(truth_ns)))
    return jitter.warning


def draw(kind, rms, count=130, seed=1):
    rng = np.random.default_rng(seed)
    return {
        'normal': lambda: rng.normal(0.0, rms, count),
        'even': lambda: rng.uniform(0.0, rms * 12.0**0.5, count),
        'late': lambda: rng.exponential(rms, count),
    }[kind]()


@pytest.mark.parametrize('kind', ['normal', 'even', 'late'])
@pytest.mark.parametrize('rms', [0.006, 0.012, 0.02])
@pytest.mark.parametrize('nominal', [0.1, 0.097, 0.0])
@pytest.mark.parametrize('lost', [0.0, 0.3])
def test_jitter_is_named_with_its_size(kind, rms, nominal, lost):
    text = warning(draw(kind, rms), np.random.default_rng(3).random(130) >= lost, nominal)
    size, error = (float(each) for each in re.findall(r'(\d+) m[ms]', text))
    assert 0.45 * rms <= size * 1e-3 <= 1.5 * rms
    assert error == pytest.approx(size * 2.0 * 1.2 / 0.74, rel=0.3)


@pytest.mark.parametrize('lost', [0.0, 0.1, 0.5])
@pytest.mark.parametrize('speed', [1.0, 0.98, 1.0 + 0.03 * np.sin(np.arange(130) / 10.0)])
@pytest.mark.parametrize('rms', [0.0, 0.0013])
def test_scans_of_a_motor_that_wanders_or_that_are_missing_are_not_named(lost, speed, rms):
    kept = np.random.default_rng(4).random(130) >= lost
    assert warning(draw('even', rms), kept, speed=speed) == ''


def test_single_wrong_stamps_a_restart_and_time_that_goes_back_are_not_named():
    off = np.zeros(130)
    off[::9] = 0.05
    off[40:] += 0.033
    off[90:] -= 3600.0
    assert warning(off) == ''


def test_jitter_that_displaces_no_point_is_not_named():
    off = draw('normal', 0.02)
    slow = Nod(-0.6, 0.6, 20.0, 200_003, START_NS)
    assert warning(off, nod=slow) == ''
    assert warning(off[:20]) == ''
    assert 'jitter' in warning(off[:40])


def test_stamps_that_stand_still_raise_nothing():
    jitter = ScanJitter()
    for _ in range(100):
        jitter.add(START_NS, 0.0, 0.0)
    assert jitter.warning == ''
