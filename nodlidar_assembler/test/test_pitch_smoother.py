"""Smoothed joint samples against interpolated ones, on motions that were not used to design it."""

import math

from hypothesis import example, given
from hypothesis import strategies as st
from nodlidar_assembler.clouds import pitch_smoother as module
from nodlidar_assembler.clouds.pitch_smoother import PitchSmoother
from nodlidar_assembler.clouds.spline_fit import fit
from nodlidar_sim.world.nod_motion import blended_motion
import numpy as np
import pytest
from scipy import signal

START_NS = 1_700_000_000_123_456_789
OFFSET = np.arange(682) * 97.65625e-6
STEP = math.radians(300.0) / 1024.0
SCANS = 180
LEARNT = 30  # scans


def nod(sweep=0.45, span=0.9, acceleration=150.0):
    """Return a nod as positions at times [s]."""
    knots_ns = START_NS + np.rint(np.arange(-2, 110) * sweep * 1e9).astype(np.int64)
    knots = np.resize([-span / 2.0, span / 2.0], len(knots_ns))
    motion = blended_motion(knots_ns, knots, acceleration)
    return lambda t: motion.position(START_NS + np.rint(t * 1e9).astype(np.int64))


def rippled(motion, amplitude, frequency):
    return lambda t: motion(t) + amplitude * np.sin(2.0 * np.pi * frequency * t)


def oscillating(motion, frequency, damping):
    """Return a motion whose speed oscillates after each reversal of a nod of 0.45 s."""

    def position(t):
        since = np.mod(t, 0.45)
        sign = np.where(np.mod(t, 0.9) < 0.45, 1.0, -1.0)
        swing = np.exp(-damping * since) * np.sin(2.0 * np.pi * frequency * since)
        return motion(t) + 6e-3 * sign * swing

    return position


def wandering(t):
    return 0.3 * np.sin(2.1 * t) + 0.2 * np.sin(5.3 * t + 1.0) + 0.05 * np.sin(13.0 * t + 2.0)


MOTIONS = {
    'nod': nod(),
    'slow nod': nod(1.7, 1.2),
    'fast nod': nod(0.2037, 0.5, 400.0),  # of 0.2 s, each would have the same few samples
    'sharp nod': nod(0.45, 0.9, 3000.0),
    'ripple 7 Hz': rippled(nod(), 3e-3, 7.0),
    'ripple 17 Hz': rippled(nod(), 2e-3, 17.0),
    'oscillating': oscillating(nod(), 9.0, 8.0),
    'wandering': wandering,
}


def samples_of(motion, rate, step, noise=0.0, astray=0, seed=1):
    """Return joint samples [s], [rad], of which one in `astray` has a stamp that is 6 ms off."""
    rng = np.random.default_rng(seed)
    time = rng.uniform() / rate + np.arange(-40, (SCANS * 0.1 + 1.0) * rate) / rate
    true_time = time.copy()
    if astray:
        true_time[::astray] += 0.006
    pitch = motion(true_time) + rng.normal(0.0, noise, len(time))
    return time, np.rint(pitch / step) * step


def errors_of(motion, time, pitch, smoother=None):
    """Return the RMS errors [rad] of the smoothed and the interpolated pitch of whole scans."""
    smoother = smoother or PitchSmoother()
    sample_ns = START_NS + np.rint(time * 1e9).astype(np.int64)
    smoothed, between = [], []
    for start in 0.1 * np.arange(SCANS):
        scan_ns = START_NS + round(start * 1e9)
        wanted = scan_ns + np.array([-150_000_000, round(OFFSET[-1] * 1e9) + 150_000_000])
        first, last = np.searchsorted(sample_ns, wanted)
        around = slice(max(first - 1, 0), last + 1)
        line = np.interp(OFFSET, (sample_ns - scan_ns) / 1e9, pitch)
        got = smoother.pitch(scan_ns, OFFSET, sample_ns[around], pitch[around], line)
        true = motion(start + OFFSET)
        if start >= 0.1 * LEARNT:
            smoothed.append(got - true)
            between.append(line - true)
    return rms(smoothed), rms(between)


def rms(errors):
    return math.sqrt(np.mean(np.square(errors)))


def ratio(motion, *args, **kwargs):
    smoothed, between = errors_of(motion, *samples_of(motion, *args, **kwargs))
    return smoothed / between


@pytest.mark.parametrize('name', MOTIONS)
@pytest.mark.parametrize('rate', [62.0, 100.0])
def test_smoothing_beats_interpolation(name, rate):
    assert ratio(MOTIONS[name], rate, STEP) < 0.9


def test_the_median_motion_has_three_quarters_of_the_error():
    assert np.median([ratio(motion, 100.0, STEP) for motion in MOTIONS.values()]) < 0.75


@pytest.mark.parametrize('name', ['nod', 'ripple 7 Hz', 'wandering'])
@pytest.mark.parametrize(
    ('rate', 'step', 'noise'),
    [(200.0, STEP, 0.0), (20.0, STEP, 0.0), (100.0, math.tau / 4096, 0.0)],
)
def test_other_rates_and_encoders(name, rate, step, noise):
    assert ratio(MOTIONS[name], rate, step, noise) < 0.9


@pytest.mark.parametrize('name', ['nod', 'ripple 7 Hz', 'wandering'])
def test_noise_of_a_step_of_the_encoder_is_smoothed_away(name):
    assert ratio(MOTIONS[name], 100.0, STEP, STEP) < 0.75


@pytest.mark.parametrize('seed', [1, 2, 3])
@pytest.mark.parametrize(('motion', 'rate'), [(nod(0.5), 100.0), (nod(1.7, 1.2), 50.0)])
def test_a_fine_encoder_whose_samples_repeat_is_not_taken_for_a_coarse_one(motion, rate, seed):
    # 50 and 85 samples a sweep: each sweep has the same positions, which are far from each other.
    assert ratio(motion, rate, 1e-9, seed=seed) < 0.75


def test_an_encoder_without_steps_but_with_noise():
    assert ratio(nod(), 100.0, 1e-9, 3e-3) < 0.75


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_noise_that_was_low_at_first_is_found(seed):
    """As that of stamps that jitter, while the joint is slow."""
    rng = np.random.default_rng(seed)
    time, _ = samples_of(nod(), 47.0, STEP)
    deviation = np.where(time < 6.0, 2e-4, 2e-3)
    pitch = nod()(time) + deviation * rng.normal(size=len(time))
    smoothed, between = errors_of(nod(), time, pitch)
    assert smoothed < 0.85 * between


@pytest.mark.parametrize('frequency', [24.0, 31.0, 37.0, 44.0, 48.0])
@pytest.mark.parametrize('amplitude', [1e-3, 3e-3, 6e-3])
def test_vibrations_are_not_smoothed_away(frequency, amplitude):
    assert ratio(rippled(nod(), amplitude, frequency), 100.0, STEP) < 1.02


@pytest.mark.parametrize(
    ('deviation', 'step'),
    [(15e-3, STEP), (5e-3, math.tau / 4096), (2e-3, math.tau / 16384), (1e-3, math.tau / 16384)],
)
def test_random_motion_that_no_encoder_has_as_noise_is_not_smoothed_away(deviation, step):
    """Up to a step of a potentiometer's encoder, no sample shows which of the two it is."""
    rng = np.random.default_rng(3)
    grid = np.arange(-2.0, 0.1 * SCANS + 2.0, 0.002)
    band = signal.butter(4, (1.0, 45.0), 'bandpass', fs=500.0, output='sos')
    shaken = signal.sosfilt(band, rng.normal(0.0, 1.0, len(grid)))
    shaken *= deviation / rms(shaken)
    assert ratio(lambda t: nod()(t) + np.interp(t, grid, shaken), 100.0, step) < 1.02


@pytest.mark.parametrize('name', ['nod', 'wandering'])
def test_single_stamps_that_are_off_do_little_harm(name):
    time, pitch = samples_of(MOTIONS[name], 100.0, STEP, astray=12)
    smoothed, between = errors_of(MOTIONS[name], time, pitch)
    clean, _ = errors_of(MOTIONS[name], *samples_of(MOTIONS[name], 100.0, STEP))
    assert smoothed < 0.6 * between
    assert smoothed < 2.0 * clean


def test_a_joint_at_rest_is_where_its_samples_are():
    time, _ = samples_of(nod(), 100.0, STEP)
    smoothed, _ = errors_of(lambda t: np.full(len(t), 0.123), time, np.full(len(time), 0.123))
    assert smoothed < 1e-9


def test_a_clock_that_is_set_back_does_no_harm():
    smoother, motion = PitchSmoother(), nod()
    samples = samples_of(motion, 100.0, STEP)
    first, between = errors_of(motion, *samples, smoother)
    again, _ = errors_of(motion, *samples, smoother)
    assert again < 0.9 * between
    assert again == pytest.approx(first, rel=0.2)


sizes = st.sampled_from([1e-7, STEP, 0.05, 0.5, 6.0, 1e6])


@given(
    st.lists(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=30), min_size=1, max_size=4),
    sizes,
    st.integers(1, 4),
)
@example([[0.0, 0.0, 1.0, 1.9213811646477115e-06], [0.0, 0.0], [0.0, 0.0]], 1e6, 1)
def test_whatever_the_samples_no_beam_is_nan_or_farther_than_a_reversal_explains(
    scans, size, hold
):
    smoother = PitchSmoother()
    for k, values in enumerate(scans):
        pitch = np.repeat(np.array(values) * size, hold)
        start_ns = START_NS + k * 100_000_000
        sample_ns = start_ns + np.rint(np.linspace(-0.08, 0.22, len(pitch)) * 1e9).astype(np.int64)
        between = np.interp(OFFSET, (sample_ns - start_ns) / 1e9, pitch)
        got = smoother.pitch(start_ns, OFFSET, sample_ns, pitch, between)
        beyond = np.max(np.abs(np.diff(pitch))) / 2.0 + 2.0 * max(STEP, 2.0 * size)
        assert np.all(np.abs(got - between) <= beyond)


@pytest.mark.parametrize('first', [0.02, 0.05])
def test_samples_before_a_pause_do_not_count(monkeypatch, first):
    """As when joint states stop for 9 s: 900 knots would be fitted."""
    fitted = []

    def counted(*args):
        fitted.append(args[-1].shape[1])
        return fit(*args)

    monkeypatch.setattr(module, 'fit', counted)
    motion, smoother = nod(), PitchSmoother()
    time, pitch = samples_of(motion, 100.0, STEP)
    kept = (time < 0.1) | (time > 9.1)
    start = time[time > 9.1][0] + first
    scan_ns = START_NS + round(start * 1e9)
    sample_ns = START_NS + np.rint(time[kept] * 1e9).astype(np.int64)
    near = np.abs(time[kept] - start) < 0.3
    near[np.flatnonzero(time[kept] < 0.1)[-1]] = True
    line = np.interp(OFFSET, time - start, pitch)
    got = smoother.pitch(scan_ns, OFFSET, sample_ns[near], pitch[kept][near], line)
    assert fitted[0] < 60
    assert rms(got - motion(start + OFFSET)) < 2.0 * STEP
