"""The pitch estimators against SLERP of quaternions and closed forms."""

from itertools import pairwise
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.pitch import beam_pitch, ordered_samples, PitchError
import numpy as np
import pytest
from transforms3d.axangles import axangle2mat
from transforms3d.quaternions import axangle2quat, qinverse, qmult, quat2axangle, quat2mat

NOD_AXIS = (0.0, -1.0, 0.0)
START_NS = 1_700_000_000_123_456_789
OFFSET = np.arange(682) * 97.65625e-6
MAX_GAP = 0.1


def pitch_of(estimator, sample_time, sample_pitch, offset=OFFSET, max_gap=MAX_GAP):
    sample_ns = START_NS + np.rint(np.asarray(sample_time) * 1e9).astype(np.int64)
    return beam_pitch(estimator, START_NS, offset, sample_ns, np.asarray(sample_pitch), max_gap)


def slerp_matrix(pitch0, pitch1, share):
    """Return the SLERP of two nod rotations, by quaternions, as a matrix."""
    q0, q1 = axangle2quat(NOD_AXIS, pitch0), axangle2quat(NOD_AXIS, pitch1)
    axis, angle = quat2axangle(qmult(qinverse(q0), q1))
    return quat2mat(qmult(q0, axangle2quat(axis, share * angle)))


pitches = st.floats(-1.5, 1.5)


@given(pitches, pitches, st.integers(0, 681))
def test_interpolated_angle_is_the_slerp_of_the_rotations(pitch0, pitch1, beam):
    end = (round(OFFSET[-1] * 1e9) + 1) / 1e9  # stamps are whole nanoseconds
    pitch = pitch_of('slerp', [0.0, end], [pitch0, pitch1])
    expected = slerp_matrix(pitch0, pitch1, OFFSET[beam] / end)
    np.testing.assert_allclose(axangle2mat(NOD_AXIS, pitch[beam]), expected, atol=2e-8)


@given(st.lists(pitches, min_size=6, max_size=6))
def test_slerp_is_piecewise_through_every_sample_and_never_beyond_its_neighbours(values):
    times = np.array([-0.01, 0.01, 0.02, 0.045, 0.06, 0.08])
    pitch = pitch_of('slerp', times, values)
    for k, (t0, t1) in enumerate(pairwise(times)):
        inside = pitch[(t0 <= OFFSET) & (t1 >= OFFSET)]
        low, high = sorted(values[k : k + 2])
        assert np.all((inside >= low - 1e-12) & (inside <= high + 1e-12))


def test_ends_cuts_the_corner_that_slerp_follows():
    times = np.array([-1e-9, OFFSET[340], OFFSET[-1] + 1e-9])
    values = np.array([0.0, 0.1, 0.0])
    assert pitch_of('slerp', times, values)[340] == pytest.approx(0.1, abs=1e-6)
    np.testing.assert_allclose(pitch_of('ends', times, values), 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ('times', 'message'),
    [
        ([0.01, 0.08], 'before the first beam'),
        ([-0.01, 0.06], 'after the last beam'),
        ([], 'no joint samples'),
        ([-0.09, 0.07], 'apart'),
    ],
)
def test_what_cannot_be_bracketed_is_refused(times, message):
    with pytest.raises(PitchError, match=message):
        pitch_of('slerp', times, np.zeros(len(times)))


@pytest.mark.parametrize('estimator', ['ends', 'slerp'])
@pytest.mark.parametrize('nanosecond', [0.3, 0.5, 0.7])
def test_a_sample_at_the_rounded_instant_of_the_last_beam_is_not_before_it(estimator, nanosecond):
    offset = np.array([0.0, 0.03, 0.06 + nanosecond * 1e-9])
    last_ns = round(0.06e9 + nanosecond)
    pitch = pitch_of(estimator, [0.0, last_ns / 1e9], [0.0, 0.6], offset)
    np.testing.assert_allclose(pitch, [0.0, 0.3, 0.6], atol=1e-7)


def test_a_sample_a_nanosecond_before_the_last_beam_is_refused():
    with pytest.raises(PitchError, match='after the last beam'):
        pitch_of('slerp', [0.0, 0.06], [0.0, 0.6], np.array([0.0, 0.06 + 1.1e-9]))


def test_a_gap_outside_of_the_scan_does_not_matter():
    pitch = pitch_of('slerp', [-5.0, -0.01, 0.03, 0.07, 9.0], [9.0, 0.0, 0.0, 0.0, 9.0])
    assert np.array_equal(pitch, np.zeros(682))


def test_nearest_refuses_a_sample_too_far_away():
    with pytest.raises(PitchError, match='within'):
        pitch_of('nearest', [0.5], [0.0])


@given(
    st.lists(
        st.tuples(
            st.integers(0, 20), st.one_of(st.floats(-1, 1), st.sampled_from([math.nan, math.inf]))
        )
    )
)
def test_ordered_samples_are_the_first_finite_one_of_each_stamp(samples):
    stamps = np.array([s for s, _ in samples], dtype=np.int64)
    values = np.array([v for _, v in samples], dtype=np.float64)
    got_ns, got = ordered_samples(stamps, values)
    expected = {s: v for s, v in reversed(samples) if math.isfinite(v)}
    assert got_ns.tolist() == sorted(expected)
    assert got.tolist() == [expected[s] for s in sorted(expected)]
