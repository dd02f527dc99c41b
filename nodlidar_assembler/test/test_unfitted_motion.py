"""What a fit leaves of joint samples: motion or noise."""

from nodlidar_assembler.clouds.unfitted_motion import clipped, evident, UnfittedMotion
import numpy as np
import pytest

COUNT = 1500
NOISE = 1e-3
NO_INFLUENCE = np.zeros(2)


def gain_of(left, noise, influence=NO_INFLUENCE):
    """Return the gain after samples that arrive ten at a time."""
    unfitted = UnfittedMotion()
    for first in range(0, len(left), 10):
        unfitted.add(left[first : first + 10], influence, noise**2)
    return unfitted.gain


def white(deviation, seed=1):
    return np.random.default_rng(seed).normal(0.0, deviation, COUNT)


def vibration(amplitude, frequency, offset=0.0):
    """Return positions of a vibration, its frequency [1 / sample], at samples + offset."""
    return amplitude * np.sin(2.0 * np.pi * frequency * (np.arange(COUNT) + offset) + 0.3)


def test_noise_is_not_added():
    assert gain_of(white(NOISE), NOISE) < 0.15


@pytest.mark.parametrize('frequency', [0.2, 0.3, 0.4, 0.48])
def test_a_vibration_without_noise_is(frequency):
    assert gain_of(vibration(3e-3, frequency), 1e-6) > 0.95


@pytest.mark.parametrize('frequency', [0.25, 0.35, 0.45])
@pytest.mark.parametrize('amplitude', [1e-3, 2e-3, 4e-3])
def test_no_other_gain_is_much_better(frequency, amplitude):
    """By the errors at nine places between neighbouring samples."""
    left = vibration(amplitude, frequency) + white(NOISE)
    gains = np.linspace(0.0, 1.0, 101)
    squares = np.zeros(len(gains))
    for share in np.linspace(0.05, 0.95, 9):
        between = (1.0 - share) * left[:-1] + share * left[1:]
        error = gains[:, None] * between - vibration(amplitude, frequency, share)[:-1]
        squares += np.mean(error**2, axis=1)
    found = gain_of(left, NOISE)
    assert np.interp(found, gains, squares) < 1.05 * squares.min()


def test_the_influence_of_samples_on_their_fit_is_not_taken_for_motion():
    """A moving average leaves of white noise less than its variance, but no motion."""
    kernel = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
    noise = white(NOISE)
    left = noise - np.convolve(noise, kernel, 'same')
    influence = np.array([10.0 * kernel[2], 9.0 * kernel[1]])
    assert gain_of(left, NOISE, influence) < 0.15
    assert gain_of(left, 0.7 * NOISE, influence) > 0.3


def test_nothing_left_is_no_motion():
    assert gain_of(np.zeros(COUNT), NOISE) == 0.0
    assert UnfittedMotion().gain == 0.0


def test_a_single_large_rest_is_clipped_and_a_vibration_is_not():
    left = white(NOISE)
    left[700] = 0.1
    assert np.abs(clipped(left, NOISE**2)).max() < 5.0 * NOISE
    rest = vibration(5e-3, 0.37)
    np.testing.assert_array_equal(clipped(rest, NOISE**2), rest)


def test_white_noise_shows_hardly_any_motion():
    left = white(NOISE)
    shown = evident(left, NOISE**2) * left
    assert np.sqrt(np.mean(shown**2)) < 0.4 * NOISE


def test_neighbours_show_a_motion_that_a_fit_missed():
    left = white(NOISE)
    left[700:704] += np.array([1.0, 2.0, -2.0, -1.0]) * 0.02
    gain = evident(left, NOISE**2)
    assert np.all(gain[700:704] > 0.95)
    assert np.all(UnfittedMotion().motion(left, clipped(left, NOISE**2), NOISE**2)[701:703] != 0.0)


def test_a_motion_that_neighbours_show_is_not_clipped_where_all_is_motion():
    """As after a rest, of which a fit leaves nothing."""
    unfitted, slight = UnfittedMotion(), vibration(NOISE, 0.1)
    for first in range(0, COUNT, 10):
        unfitted.add(slight[first : first + 10], NO_INFLUENCE, 0.0)
    assert unfitted.gain > 0.95
    left = np.zeros(40)
    left[20:24] = np.array([1.0, 2.0, -2.0, -1.0]) * 0.02
    motion = unfitted.motion(left, clipped(left, (0.01 * NOISE) ** 2), (0.01 * NOISE) ** 2)
    np.testing.assert_allclose(motion[20:24], left[20:24], rtol=1e-3)


def test_a_single_bad_stamp_shows_no_motion():
    left = np.zeros(COUNT)
    left[700] = 0.1
    assert np.all(evident(left, NOISE**2) == 0.0)


def test_too_few_samples_show_no_motion():
    for count in (0, 1, 2):
        assert np.all(evident(np.full(count, 0.1), NOISE**2) == 0.0)
