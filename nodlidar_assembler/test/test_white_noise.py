"""The white noise of joint samples: found beside a nod, and not taken for vibrations."""

from nodlidar_assembler.clouds.white_noise import WhiteNoise
import numpy as np
import pytest

RATE = 100.0
TIME = np.arange(3000) / RATE
NOD = 0.6 * np.arcsin(np.sin(np.pi * TIME / 0.39)) / (np.pi / 2.0)


def found_in(pitch):
    """Return the deviation [rad] that is found in samples which arrive forty at a time."""
    noise = WhiteNoise()
    variance = 0.0
    for first in range(0, len(pitch), 40):
        variance = noise.add(pitch[first : first + 40])
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


def test_without_samples_there_is_none():
    assert WhiteNoise().add(np.zeros(3)) == 0.0
