"""What vibrations do between joint samples."""

from nodlidar_assembler.clouds.between_samples import aliases, at, LAGS, lines, PHASES, spread
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

COUNT = 200
PLACE = np.arange(COUNT, dtype=float)
FINE = np.arange((COUNT - 1) * PHASES + 1) / PHASES
INNER = slice(4 * LAGS * PHASES, -4 * LAGS * PHASES)  # a spline errs at its ends


def vibration(frequency, place):
    return 2e-3 * np.cos(2.0 * np.pi * frequency * place + 0.4)


def as_likely(frequency):
    """Return the mean of a vibration and its aliases, power falling by the third power."""
    all_of_them = frequency + np.arange(-20, 21)
    weight = np.abs(all_of_them) ** -3
    phase = 2.0 * np.pi * all_of_them[:, None] * FINE + 0.4
    return 2e-3 * (weight / weight.sum()) @ np.cos(phase)


@pytest.mark.parametrize('frequency', [0.12, 0.23, 0.31, 0.4, 0.47])
def test_a_spline_with_what_it_lacks_is_the_mean_of_all_aliases(frequency):
    """The spline of fifth degree through samples is that with the least jerk (Schoenberg 1964)."""
    pitch = vibration(frequency, PLACE)
    spline = make_interp_spline(PLACE, pitch, k=5)(FINE)
    expected = as_likely(frequency)[INNER]
    before = np.abs(spline[INNER] - expected).max()
    after = np.abs((spline + aliases(PLACE, pitch))[INNER] - expected).max()
    assert after < max(0.2 * before, 2e-5)


@pytest.mark.parametrize('frequency', [0.55, 0.62])
def test_a_vibration_above_half_the_rate_does_less_harm(frequency):
    pitch, true = vibration(frequency, PLACE), vibration(frequency, FINE)
    spline = make_interp_spline(PLACE, pitch, k=5)(FINE)
    errors = spline - true, spline + aliases(PLACE, pitch) - true
    alone, corrected = (np.sqrt(np.mean(error[INNER] ** 2)) for error in errors)
    assert corrected < 0.85 * alone


@pytest.mark.parametrize('frequency', [0.01, 0.05])
def test_a_slow_motion_lacks_nothing(frequency):
    assert np.abs(aliases(PLACE, vibration(frequency, PLACE))).max() < 0.005 * 2e-3


def test_lines_lack_nothing_wherever_samples_are():
    place = np.sort(np.random.default_rng(1).uniform(0.0, 100.0, COUNT))
    assert np.abs(aliases(place, 0.3 * place - 2.0)).max() < 1e-9


def test_a_reversal_counts_no_more_than_the_vibration_around_it():
    pitch = vibration(0.4, PLACE)
    reversal = pitch - 0.1 * np.abs(PLACE - COUNT / 2)
    assert np.abs(aliases(PLACE, reversal)).max() < 4.0 * np.abs(aliases(PLACE, pitch)).max()


@pytest.mark.parametrize('count', [1, 2])
def test_few_samples_show_no_vibration(count):
    np.testing.assert_array_equal(
        aliases(PLACE[:count], PLACE[:count]), np.zeros((count - 1) * PHASES + 1)
    )


def test_a_kernel_is_centred_on_each_sample():
    kernel = np.arange(2 * LAGS * PHASES + 1, dtype=float)
    spread_out = spread(np.array([0.0, 1.0, 0.0, 0.0]), kernel)
    middle = LAGS * PHASES
    np.testing.assert_array_equal(spread_out, kernel[middle - PHASES : middle + 2 * PHASES + 1])


def test_values_are_found_again_at_uneven_places():
    place, values = np.array([0.0, 1.0, 4.0]), np.array([2.0, 5.0, -1.0])
    wanted = np.array([0.0, 0.25, 1.0, 2.5, 4.0])
    np.testing.assert_allclose(at(wanted, place, lines(values)), [2.0, 2.75, 5.0, 2.0, -1.0])
