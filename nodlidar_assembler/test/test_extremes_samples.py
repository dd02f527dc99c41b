"""Joint samples at their limits: how close, how late, and at which times (docs/extremes.md)."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.pitch import PitchError
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, ESTIMATORS, PitchEstimator
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.scan_assembler import ScanAssembler
import numpy as np
import pytest

S, MS = 1_000_000_000, 1_000_000
OFFSET = np.arange(682) * 97.65625e-6
SPEED = 3.0  # of the joint [rad/s]
STARTS_NS = {
    'at 0': 0,
    'across a second': 7 * S - 33 * MS,
    'today': 1_700_000_000 * S + 123_456_789,
    'across 2^31 s': 2**31 * S - 33 * MS,
}
BETWEEN = ('ends', 'slerp', 'trajectory')


def pitch_of(name, sample_ns, sample_pitch, start_ns=0):
    """Return the pitch of each beam of a scan; samples count from its first beam."""
    stamps = start_ns + np.array(sample_ns, dtype=np.int64)
    return PitchEstimator(EstimatorConfig(estimator=name)).pitch(
        start_ns, OFFSET, stamps, np.array(sample_pitch)
    )


def steady(sample_ns):
    """Return the pitch of a joint of constant speed."""
    return SPEED * np.array(sample_ns, dtype=np.int64) / S - 0.1


@pytest.mark.parametrize('start_ns', STARTS_NS.values(), ids=STARTS_NS)
@pytest.mark.parametrize('name', BETWEEN)
def test_whatever_the_stamps_every_beam_has_its_pitch(name, start_ns):
    sample_ns = np.arange(0, 80 * MS, MS)
    found = pitch_of(name, sample_ns, steady(sample_ns), start_ns)
    np.testing.assert_allclose(found, SPEED * OFFSET - 0.1, rtol=0, atol=1e-12)


@pytest.mark.parametrize('start_ns', STARTS_NS.values(), ids=STARTS_NS)
def test_whatever_the_stamps_nearest_takes_the_nearest(start_ns):
    found = pitch_of('nearest', [-2 * MS, MS, 9 * MS], [0.1, 0.2, 0.3], start_ns)
    assert np.array_equal(found, np.full(682, 0.2))


@pytest.mark.parametrize('name', BETWEEN)
def test_samples_a_nanosecond_apart_are_two_samples(name):
    each = np.arange(0, 80 * MS, MS)
    sample_ns = np.sort(np.concatenate([each, each + 1]))
    found = pitch_of(name, sample_ns, steady(sample_ns))
    np.testing.assert_allclose(found, SPEED * OFFSET - 0.1, rtol=0, atol=1e-12)


def test_a_step_within_a_nanosecond_is_followed():
    """One of several ticks of an encoder; a larger one is a jump."""
    sample_ns = [0, 30 * MS, 30 * MS + 1, 80 * MS]
    found = pitch_of('slerp', sample_ns, [0.1, 0.1, 0.14, 0.14])
    expected = np.where(OFFSET * S <= 30 * MS, 0.1, 0.14)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize('name', ESTIMATORS)
@given(st.randoms(use_true_random=False))
def test_out_of_order_repeated_and_unfinite_samples_are_put_in_order(name, random):
    """Of equal stamps the first one counts: a wrong one is put after each right one."""
    sample_ns = np.arange(-8 * MS, 80 * MS, 8 * MS)
    right = list(zip(sample_ns, steady(sample_ns), strict=True))
    random.shuffle(right)
    wrong = [(t, random.choice([9.0, math.nan, math.inf, -math.inf, 1.7e308])) for t, _ in right]
    stamps, pitch = zip(*right, *wrong, (40 * MS, math.nan), strict=True)
    expected = pitch_of(name, sample_ns, steady(sample_ns))
    np.testing.assert_array_equal(pitch_of(name, stamps, pitch), expected)


@pytest.mark.parametrize('name', BETWEEN)
@pytest.mark.parametrize('gap_ns', [100 * MS + 1000, 5 * S, 3600 * S])
def test_a_gap_within_the_scan_is_refused(name, gap_ns):
    with pytest.raises(PitchError, match=r'joint samples more than 0\.1 s apart'):
        pitch_of(name, [-MS, gap_ns - MS], [0.0, 0.1])


@pytest.mark.parametrize('name', ESTIMATORS)
def test_without_finite_samples_there_is_no_pitch(name):
    for samples in ([], []), ([0, 80 * MS], [math.nan, math.inf]), ([0, 80 * MS], [-1.1e6, 1e308]):
        with pytest.raises(PitchError, match='no joint samples'):
            pitch_of(name, *samples)


@pytest.mark.parametrize('name', ESTIMATORS)
def test_a_single_beam_takes_the_pitch_of_its_instant(name):
    found = PitchEstimator(EstimatorConfig(estimator=name)).pitch(
        0, np.zeros(1), np.array([0]), np.array([0.3])
    )
    assert np.array_equal(found, [0.3])


@pytest.mark.parametrize('start_ns', [0, 7 * S - 33 * MS, (2**31 - 1) * S + 900 * MS])
@pytest.mark.parametrize('margin_ns', [0, 200 * MS])
def test_a_scan_is_bracketed_at_the_ends_of_time_too(start_ns, margin_ns):
    estimator = 'trajectory' if margin_ns else 'slerp'
    assembler = ScanAssembler(AssemblerConfig(estimator=estimator, smoothing_margin=margin_ns / S))
    given = []
    assembler._pipeline.add_scan = lambda scan, *samples: given.append(samples[0].tolist())
    stamps = [start_ns + k * 10 * MS for k in range(0, 10)]
    for stamp_ns in stamps:
        assembler.add_joint_sample(stamp_ns, 0.1)
    two_beams = ScanGeometry(2, 0.0, 1.0, 0.066, 0.02, 5.6)
    assembler.add_scan(Scan(start_ns, two_beams, np.ones(2, np.float32)), 0)
    list(assembler.ready(S))  # past the deadline: with a margin it waits for more
    assert given == [stamps if margin_ns else stamps[:8]]
