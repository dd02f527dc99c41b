"""The leg model against the closed form of the motion, with a fine encoder and a coarse one."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.clouds.leg_model import leg_pitch, LegModelError, OTHER_MOTION, TOO_FEW
from nodlidar_sim.world.motion import blended_motion
import numpy as np
import pytest

START_NS = 1_700_000_000_123_456_789
OFFSET = np.arange(682) * 97.65625e-6
STEP = math.radians(300.0) / 1024.0
PERIOD = 1.0 / 62.0
STARTS = np.linspace(0.8, 2.4, 81)  # of scans, all over the nod [s]


def nod_of(sweeps, acceleration, span=1.2272):
    """Return a nod between two limits, of sweeps [s] that begin at START_NS."""
    knots_ns = START_NS + np.rint(np.cumsum([0.0, *sweeps]) * 1e9).astype(np.int64)
    return blended_motion(
        knots_ns, np.resize([-span / 2.0, span / 2.0], len(knots_ns)), acceleration
    )


def samples_of(position, start, margin, step):
    """Return the joint samples from `margin` [s] before a scan to as much after it."""
    ticks = np.arange(
        math.floor((start - margin) / PERIOD),
        math.ceil((start + margin + OFFSET[-1]) / PERIOD) + 1,
    )
    sample_ns = START_NS + np.rint(ticks * PERIOD * 1e9).astype(np.int64)
    pitch = position(sample_ns)
    return sample_ns, np.rint(pitch / step) * step


def errors_of(position, start, margin=0.2, step=STEP):
    """Return the errors of a scan's beams [rad] by the leg model and by interpolation."""
    scan_ns = START_NS + round(start * 1e9)
    samples = samples_of(position, start, margin, step)
    true = position(scan_ns + np.rint(OFFSET * 1e9).astype(np.int64))
    between = np.interp(OFFSET, (samples[0] - scan_ns) / 1e9, samples[1])
    return leg_pitch(scan_ns, OFFSET, *samples, step) - true, between - true


def rms(errors):
    return math.sqrt(np.mean(np.square(errors)))


EVEN = [0.390723] * 9
UNEVEN = [0.40, 0.38, 0.45, 0.36, 0.39, 0.42, 0.37, 0.40, 0.39]


@pytest.mark.parametrize('acceleration', [120.0, 200.0, 400.0])
@pytest.mark.parametrize('sweeps', [EVEN, UNEVEN])
def test_with_a_fine_encoder_every_beam_is_exact_in_mid_leg_and_at_the_turns(sweeps, acceleration):
    nod = nod_of(sweeps, acceleration)
    for start in STARTS:
        errors, _ = errors_of(nod.position, start, step=1e-6)
        assert np.max(np.abs(errors)) < 1e-5


@pytest.mark.parametrize('sweeps', [EVEN, UNEVEN])
@pytest.mark.parametrize('acceleration', [120.0, 200.0])
def test_it_beats_the_rounding_over_whole_sweeps(sweeps, acceleration):
    nod = nod_of(sweeps, acceleration)
    fitted, between = zip(*(errors_of(nod.position, s) for s in STARTS), strict=True)
    assert rms(fitted) < 0.8e-3
    assert rms(between) > 1.5e-3


def test_slow_legs_longer_than_the_window_are_lines():
    nod = nod_of([3.0], 200.0)
    fitted, between = zip(*(errors_of(nod.position, s) for s in STARTS), strict=True)
    assert rms(fitted) < 0.6 * rms(between)


def test_a_reversal_that_just_begins_at_the_end_of_the_window_does_no_harm():
    nod = nod_of(EVEN, 200.0)
    reversal = 3 * EVEN[0]
    for seen_after in np.arange(-0.02, 0.06, 0.005):
        start = reversal + seen_after - OFFSET[-1] - 0.2
        errors, _ = errors_of(nod.position, start)
        assert rms(errors) < STEP / 2.0


@pytest.mark.parametrize('late', [-0.005, 0.002, 0.005])
def test_single_stamps_that_are_off_do_no_harm(late):
    nod = nod_of(EVEN, 200.0)
    fitted, between = [], []
    for start in STARTS:
        scan_ns = START_NS + round(start * 1e9)
        sample_ns, pitch = samples_of(nod.position, start, 0.2, STEP)
        astray = np.arange(len(sample_ns)) % 12 == 5
        true_ns = sample_ns + np.where(astray, round(late * 1e9), 0)
        pitch = np.rint(nod.position(true_ns) / STEP) * STEP
        true = nod.position(scan_ns + np.rint(OFFSET * 1e9).astype(np.int64))
        fitted.append(leg_pitch(scan_ns, OFFSET, sample_ns, pitch, STEP) - true)
        between.append(np.interp(OFFSET, (sample_ns - scan_ns) / 1e9, pitch) - true)
    assert rms(fitted) < 0.8e-3
    assert rms(between) > 2.0 * rms(fitted)


@given(st.floats(-1.5, 1.5))
def test_a_joint_at_rest_is_where_its_samples_are(pitch):
    errors, _ = errors_of(lambda times_ns: np.full(len(times_ns), pitch), 1.0, step=1e-6)
    np.testing.assert_allclose(errors, 0.0, atol=1e-6)


def sine(times_ns):
    return 0.6 * np.sin((times_ns - START_NS) / 1e9 * 15.0)


def jump(times_ns):
    return np.where(times_ns - START_NS < 1_033_000_000, 0.0, 0.2)


def absurd(times_ns):
    return np.where(times_ns - START_NS < 1_033_000_000, 1e300, -1e300)


@pytest.mark.parametrize('motion', [sine, jump, absurd])
def test_another_motion_is_refused(motion):
    with pytest.raises(LegModelError, match=OTHER_MOTION):
        errors_of(motion, 1.0)


def test_too_few_samples_for_the_turns_are_refused():
    nod = nod_of(EVEN, 200.0)
    with pytest.raises(LegModelError, match=TOO_FEW):
        errors_of(nod.position, 3 * EVEN[0] - 0.03, margin=0.02)


sizes = st.sampled_from([STEP, 0.05, 0.5, 6.0])


@settings(deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=30), sizes, st.integers(1, 4))
def test_whatever_the_samples_no_beam_is_nan_or_farther_than_a_turn_explains(values, size, hold):
    pitch = np.repeat(np.array(values) * size, hold)
    sample_ns = START_NS + np.rint(np.linspace(-0.2, 0.27, len(pitch)) * 1e9).astype(np.int64)
    try:
        got = leg_pitch(START_NS, OFFSET, sample_ns, pitch, STEP)
    except LegModelError:
        return
    between = np.interp(OFFSET, (sample_ns - START_NS) / 1e9, pitch)
    beyond = np.max(np.abs(np.diff(pitch))) / 2.0 + 2.0 * STEP
    assert np.all(np.abs(got - between) <= beyond)
