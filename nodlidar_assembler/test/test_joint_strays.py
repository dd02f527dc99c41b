"""Single positions of the joint that are not of its motion are refused, and no others."""

import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nodlidar_assembler.inputs.joint_strays import JointStrays, SLACK
import numpy as np
import pytest

S = 10**9
T0 = 1_763_900_000 * S


def fed(samples):
    """Return the samples that are passed on, and how many are refused."""
    refused = []
    strays = JointStrays(lambda: refused.append(1))
    passed = [one for each in samples for one in strays.add(each)]
    return passed, len(refused)


def wave(share, shape):
    """Return the position within a nod of -1 to 1, of which a share has passed."""
    straight = 4.0 * np.abs((share + 0.25) % 1.0 - 0.5) - 1.0
    return np.sin(straight * np.pi / 2.0) if shape == 'sine' else straight


NODS = {
    'rate': st.sampled_from([10.0, 25.0, 60.0, 100.0, 400.0, 1000.0]),
    'speed': st.floats(0.0, 20.0),
    'span': st.floats(0.05, 3.0),
    'phase': st.floats(0.0, 1.0),
    'shape': st.sampled_from(['triangle', 'sine']),
    'rest': st.floats(0.0, 1.0),
    'seed': st.integers(0, 2**32 - 1),
}


def nod(rate, speed, span, phase, shape, rest, seed, jitter=0.0, noise=0.0):
    """Return the samples of a joint that rests, and nods from anywhere; and its rate.

    Stamps jitter by a share of the time between samples, but keep their order.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(120) / rate
    moving, begun = np.maximum(times - rest, 0.0), speed / 200.0 + 1e-9  # at 200 rad/s^2
    moving = np.where(moving < begun, moving**2 / begun / 2.0, moving - begun / 2.0)
    positions = span / 2.0 * wave(phase + moving * speed / (2.0 * span), shape)
    positions = positions + rng.normal(0.0, noise, len(times))
    stamps = times + rng.uniform(-jitter, jitter, len(times)) / rate
    return [*zip((T0 + np.sort(stamps) * S).astype(int).tolist(), positions.tolist(), strict=True)]


@settings(max_examples=150)
@given(jitter=st.floats(0.0, 0.5), noise=st.sampled_from([0.0, 1e-3, 4e-3]), **NODS)
def test_no_sample_of_a_nod_is_refused(rate, speed, span, jitter, noise, **about):
    assume(speed / span <= rate / 4.0)  # four samples from limit to limit, or more
    samples = nod(rate, speed, span, jitter=jitter, noise=noise, **about)
    passed, refused = fed(samples)
    assert refused == 0
    assert passed == samples[: len(passed)]
    assert len(passed) >= len(samples) - 1


@settings(max_examples=150)
@given(
    every=st.integers(3, 40),
    off=st.floats(0.0, 3.0),
    up=st.booleans(),
    when=st.floats(0.1, 0.9),
    jitter=st.floats(0.0, 0.3),
    **NODS,
)
def test_each_stray_beyond_the_gate_is_refused_and_nothing_else(
    every, off, up, when, jitter, rate, speed, span, shape, **about
):
    """But where a joint begins to move: nothing says then how fast it is."""
    assume(speed / span <= rate / 4.0)
    samples = nod(rate, speed, span, shape=shape, jitter=jitter, **about | {'rest': 0.0})
    fastest = speed * (math.pi / 2.0 if shape == 'sine' else 1.0)
    # Between two samples jitter adds 0.6 of the time, and the joint moves meanwhile.
    longest = 1.6 / rate
    off += SLACK + 2.5 * fastest * longest + min(150.0 * longest**2, 6.0 * longest) + 1e-6
    fed_in, strays = [], 0
    for k, (time_ns, pitch) in enumerate(samples):
        fed_in.append((time_ns, pitch))
        if k >= 20 and k % every == 0 and k + 1 < len(samples):
            between = time_ns + round(when * (samples[k + 1][0] - time_ns))
            if time_ns < between < samples[k + 1][0]:
                fed_in.append((between, pitch + (off if up else -off)))
                strays += 1
    assert fed(fed_in) == (samples, strays)


@pytest.mark.parametrize('shift', [0.1, -0.5, 6.28])
def test_a_joint_that_jumps_and_stays_there_is_passed_on(shift):
    samples = nod(100.0, 1.7, 1.2, 0.0, 'triangle', 0.0, 1)
    samples = [(t, p + (shift if k >= 50 else 0.0)) for k, (t, p) in enumerate(samples)]
    assert fed(samples) == (samples, 0)


def test_samples_are_held_back_only_where_they_leap():
    strays = JointStrays(lambda: None)
    for each in nod(100.0, 1.7, 1.2, 0.0, 'triangle', 0.0, 1):
        assert strays.add(each) == [each]
    last_ns, last = each
    assert strays.add((last_ns + S // 100, last + 0.3)) == []
    after = (last_ns + S // 50, last + 0.6)
    assert strays.add(after) == [(last_ns + S // 100, last + 0.3), after]


@pytest.mark.parametrize('back_ns', [S // 400, 3600 * S])
def test_after_time_went_back_a_joint_may_be_anywhere(back_ns):
    strays = JointStrays(pytest.fail)
    samples = nod(100.0, 1.7, 1.2, 0.0, 'triangle', 0.0, 1)
    for each in samples:
        strays.add(each)
    last_ns, last = samples[-1]
    assert strays.add((last_ns + S // 100, last + 0.5)) == []
    for k in range(5):
        sample = last_ns + S // 100 - back_ns + k * S // 100, -0.4
        assert strays.add(sample) == [sample]
