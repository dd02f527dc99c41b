"""The white noise of joint samples: found beside a nod, and not taken for vibrations."""

from nodlidar_assembler.clouds.white_noise import WhiteNoise
import numpy as np
import pytest

START_NS = 1_700_000_000_123_456_789
RATE = 100.0
TIME = np.arange(3000) / RATE
NOD = 0.6 * np.arcsin(np.sin(np.pi * TIME / 0.39)) / (np.pi / 2.0)


def found_in(pitch, time=TIME):
    """Return the deviation [rad] that is found in samples which arrive in overlapping windows."""
    noise = WhiteNoise()
    time_ns = START_NS + np.rint(time * 1e9).astype(np.int64)
    variance = 0.0
    for first in range(0, len(pitch), 40):
        window = slice(max(0, first - 15), first + 40)
        noise.add(time_ns[window], pitch[window])
        variance = noise.variance()
    return np.sqrt(variance)


@pytest.mark.parametrize('deviation', [1e-3, 5e-3, 2e-2])
@pytest.mark.parametrize('motion', [0.0 * TIME, NOD])
def test_white_noise_is_found(motion, deviation):
    noise = np.random.default_rng(3).normal(0.0, deviation, len(TIME))
    assert found_in(motion + noise) == pytest.approx(deviation, rel=0.25)


@pytest.mark.parametrize('frequency', [28.0, 35.0, 42.0, 48.0])
def test_a_vibration_is_not_noise(frequency):
    vibration = 5e-3 * np.sin(2.0 * np.pi * frequency * TIME)
    assert found_in(vibration) < 0.3 * 5e-3 / np.sqrt(2.0)


def test_a_vibration_of_many_frequencies_is_hardly_noise():
    rng = np.random.default_rng(5)
    phases = rng.uniform(0.0, 2.0 * np.pi, 200)
    frequencies = np.linspace(20.0, 44.0, 200)
    vibration = np.sin(2.0 * np.pi * np.outer(TIME, frequencies) + phases).sum(axis=1)
    vibration *= 5e-3 / np.sqrt(np.mean(vibration**2))
    assert found_in(NOD + vibration) < 0.4 * 5e-3


@pytest.mark.parametrize('jitter', [3e-4, 1e-3, 2e-3, 3e-3, 4e-3])
def test_stamps_that_jitter_are_noise_by_the_way_within_the_jitter(jitter):
    speed = 1.2 / 0.39
    stamps = TIME + np.random.default_rng(7).normal(0.0, jitter, len(TIME))
    order = np.argsort(stamps)
    assert found_in(NOD[order], stamps[order]) == pytest.approx(jitter * speed, rel=0.25)


def test_uneven_stamps_that_are_right_are_no_noise():
    uneven = TIME + np.random.default_rng(7).uniform(-3e-3, 3e-3, len(TIME))
    assert found_in(0.6 * np.sin(3.0 * uneven), uneven) < 1e-5


def test_lost_samples_are_no_noise():
    rng = np.random.default_rng(4)
    kept = rng.uniform(size=len(TIME)) > 0.3
    pitch = NOD + rng.normal(0.0, 1e-3, len(TIME))
    assert found_in(pitch[kept], TIME[kept]) == pytest.approx(1e-3, rel=0.25)


def test_with_few_samples_there_is_none():
    noise = WhiteNoise()
    assert noise.variance() == 0.0
    for count in (1, 2, 60):
        time_ns = START_NS + 10_000_000 * np.arange(count)
        noise.add(time_ns, np.random.default_rng(1).normal(0.0, 1e-3, count))
        assert noise.variance() == 0.0


def test_after_a_clock_was_set_back_the_noise_is_that_of_the_samples_since():
    noise = WhiteNoise()
    rng = np.random.default_rng(6)
    for begin_ns, deviation in ((START_NS, 5e-3), (START_NS - 3600 * 10**9, 1e-3)):
        for first in range(0, 1000, 40):
            time_ns = begin_ns + 10_000_000 * np.arange(first, first + 40)
            noise.add(time_ns, rng.normal(0.0, deviation, 40))
            variance = noise.variance()
    assert np.sqrt(variance) == pytest.approx(1e-3, rel=0.25)


def test_asking_again_without_new_samples_changes_nothing():
    rng = np.random.default_rng(8)
    often, once = WhiteNoise(), WhiteNoise()
    for first, deviation in ((0, 5e-3), (600, 1e-3)):
        for begin in range(first, first + 600, 40):
            time_ns = START_NS + 10_000_000 * np.arange(begin, begin + 40)
            pitch = rng.normal(0.0, deviation, 40)
            for noise in (often, once):
                noise.add(time_ns, pitch)
                found = noise.variance()
        assert all(often.variance() == found for _ in range(500))
    assert often.variance() == once.variance()
