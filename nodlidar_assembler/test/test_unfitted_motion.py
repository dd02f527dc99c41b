"""What a fit leaves of joint samples: motion or noise."""

from nodlidar_assembler.clouds.between_samples import at, LAGS
from nodlidar_assembler.clouds.unfitted_motion import evident, UnfittedMotion, usual_part
import numpy as np
import pytest

COUNT = 1500
PLACE = np.arange(COUNT)
WINDOW, NEW = 30, slice(6, 16)  # samples around a scan, and those since the one before
NOISE = 1e-3
NO_INFLUENCE = np.zeros(LAGS + 1)


def learned(left, noise, influence=NO_INFLUENCE, white=None):
    """Return what is learned of samples that arrive ten at a time."""
    unfitted = UnfittedMotion()
    variance = noise**2
    for first in range(0, len(left) - WINDOW, NEW.stop - NEW.start):
        window = left[first : first + WINDOW]
        unfitted.add(window, NEW, influence, variance, variance if white is None else white)
    return unfitted


def gain_of(*args):
    return learned(*args).gain


def motion_of(unfitted, left, noise, wanted):
    motion = unfitted.motion(left, usual_part(left, noise**2), noise**2)
    return at(wanted, np.arange(len(left)), motion)


def white(deviation, seed=1):
    return np.random.default_rng(seed).normal(0.0, deviation, COUNT)


def vibration(amplitude, frequency, place=PLACE):
    """Return positions of a vibration, its frequency [1 / sample], at places."""
    return amplitude * np.sin(2.0 * np.pi * frequency * place + 0.3)


def errors(amplitude, frequency):
    """Return the RMS errors of the motion in a noisy vibration, of lines, and of their best share.

    All between the samples, with LAGS of these on either side; lines are from sample to sample.
    """
    left = vibration(amplitude, frequency) + white(NOISE)
    wanted = np.arange(LAGS, COUNT - LAGS, 0.1)
    true = vibration(amplitude, frequency, wanted)
    lines = np.interp(wanted, PLACE, left)
    share = (lines @ true) / (lines @ lines)
    got = motion_of(learned(left, NOISE), left, NOISE, wanted)
    estimates = np.array([got, lines, share * lines])
    return np.sqrt(np.mean((estimates - true) ** 2, axis=1))


def test_noise_is_not_added():
    assert gain_of(white(NOISE), NOISE) < 0.15


@pytest.mark.parametrize('frequency', [0.2, 0.3, 0.4, 0.48])
def test_a_vibration_without_noise_is(frequency):
    left = vibration(3e-3, frequency)
    got = motion_of(learned(left, 1e-6), left, 1e-6, np.arange(LAGS, COUNT - LAGS))
    np.testing.assert_allclose(got, left[LAGS:-LAGS], atol=1e-4)


@pytest.mark.parametrize('frequency', [0.25, 0.35, 0.45])
@pytest.mark.parametrize('amplitude', [1e-3, 2e-3, 4e-3])
def test_it_is_nearer_to_a_vibration_than_any_share_of_lines(frequency, amplitude):
    error, _, of_share = errors(amplitude, frequency)
    assert error < 0.9 * of_share


@pytest.mark.parametrize('frequency', [0.52, 0.6, 0.75, 0.9])
@pytest.mark.parametrize('amplitude', [1e-3, 2e-3, 4e-3])
def test_vibrations_above_half_the_rate_do_little_harm(frequency, amplitude):
    error, of_lines, _ = errors(amplitude, frequency)
    assert error < 1.12 * of_lines


def test_the_influence_of_samples_on_their_fit_is_not_taken_for_motion():
    """A moving average leaves of white noise less than its variance, but no motion."""
    kernel = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
    noise = white(NOISE)
    left = noise - np.convolve(noise, kernel, 'same')
    influence = NO_INFLUENCE.copy()
    influence[:3] = 10.0 * kernel[2:]
    assert gain_of(left, NOISE, influence) < 0.15
    assert gain_of(left, 0.7 * NOISE, influence) > 0.3


@pytest.mark.parametrize('steps', [0.14, 0.29, 0.43])
def test_the_steps_of_an_encoder_are_not_taken_for_motion(steps):
    """At a constant speed, a smooth fit leaves all of them, though it follows white noise."""
    place = steps * PLACE + 0.2
    left = np.rint(place) - place
    noise = 12.0**-0.5
    influence = NO_INFLUENCE.copy()
    influence[0] = 4.0
    assert gain_of(left, noise, influence, 0.0) < 0.02
    assert gain_of(left, noise, influence, noise**2) > 0.1


def test_nothing_left_is_no_motion():
    assert gain_of(np.zeros(COUNT), NOISE) == 0.0
    assert UnfittedMotion().gain == 0.0


def test_a_single_large_rest_is_clipped_and_a_vibration_is_not():
    left = white(NOISE)
    left[700] = 0.1
    assert np.abs(usual_part(left, NOISE**2)).max() < 5.0 * NOISE
    rest = vibration(5e-3, 0.37)
    np.testing.assert_array_equal(usual_part(rest, NOISE**2), rest)


def test_white_noise_shows_hardly_any_motion():
    left = white(NOISE)
    shown = evident(left, NOISE**2) * left
    assert np.sqrt(np.mean(shown**2)) < 0.4 * NOISE


def test_neighbours_show_a_motion_that_a_fit_missed():
    left = white(NOISE)
    left[700:704] += np.array([1.0, 2.0, -2.0, -1.0]) * 0.02
    gain = evident(left, NOISE**2)
    assert np.all(gain[700:704] > 0.95)
    assert np.all(motion_of(UnfittedMotion(), left, NOISE, np.array([701, 702])) != 0.0)


def test_a_motion_that_neighbours_show_is_not_clipped_where_all_is_motion():
    """As after a rest, of which a fit leaves nothing."""
    unfitted = learned(vibration(NOISE, 0.1), 0.0)
    assert unfitted.gain > 0.95
    left = np.zeros(40)
    left[20:24] = np.array([1.0, 2.0, -2.0, -1.0]) * 0.02
    motion = motion_of(unfitted, left, 0.01 * NOISE, np.arange(20, 24))
    np.testing.assert_allclose(motion, left[20:24], rtol=1e-3)


def test_a_single_bad_stamp_shows_no_motion():
    left = np.zeros(COUNT)
    left[700] = 0.1
    assert np.all(evident(left, NOISE**2) == 0.0)


def test_too_few_samples_show_no_motion():
    for count in (0, 1, 2):
        assert np.all(evident(np.full(count, 0.1), NOISE**2) == 0.0)
