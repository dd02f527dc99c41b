from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
import numpy as np
import pytest

BEAMS = 1024
BEAM_NS = Fraction(NS_PER_S, 10 * BEAMS)  # ten revolutions a second
EPOCH_NS = 1_700_000_000 * NS_PER_S
SPAN = 1.2272


def nod_of(samples=4001, reference_time_ns=EPOCH_NS, pitch_min=-SPAN / 2, span=SPAN):
    return Nod(
        pitch_min=pitch_min,
        pitch_max=pitch_min + span,
        sweep_duration=float(samples * BEAM_NS / NS_PER_S),
        samples_per_sweep=samples,
        reference_time_ns=reference_time_ns,
    )


def triangle(m, samples):
    """tri(m) of the model."""
    return samples - abs(m % (2 * samples) - samples)


def exact_pitch(nod, time_ns):
    """The pitch by exact rational arithmetic on the nod's own numbers."""
    sweeps = Fraction(time_ns - nod.reference_time_ns) / (Fraction(nod.sweep_duration) * NS_PER_S)
    return nod.pitch_min + nod.span * float(triangle(sweeps, 1))


nods = st.builds(
    nod_of,
    samples=st.integers(100, 20_000),
    reference_time_ns=st.integers(0, 2 * EPOCH_NS),
    pitch_min=st.floats(-1.5, 1.0),
    span=st.floats(0.01, 2.0),
)
offsets_ns = st.integers(-3600 * NS_PER_S, 3600 * NS_PER_S)


@given(nods, offsets_ns)
def test_pitch_within_its_limits(nod, offset_ns):
    pitch = nod.pitch(nod.reference_time_ns + offset_ns)
    assert nod.pitch_min <= pitch <= nod.pitch_max + 1e-15


@given(nods, offsets_ns, st.integers(-50, 50))
def test_it_repeats_after_two_sweeps(nod, offset_ns, periods):
    time_ns = nod.reference_time_ns + offset_ns
    later_ns = nod.reversal_time_ns(2 * periods) + offset_ns
    rounding = nod.speed * 1e-9
    assert nod.pitch(later_ns) == pytest.approx(nod.pitch(time_ns), abs=2 * rounding)


@pytest.mark.parametrize('samples', [1001, 3000, 4001, 7987])
@pytest.mark.parametrize('delta', [Fraction(0), Fraction(1, 4), Fraction(1, 2)])
def test_pitch_of_each_beam_is_that_of_the_model(samples, delta):
    beams = list(range(-2 * samples, 2 * samples, 7))
    nod = nod_of(samples)
    times_ns = np.array([EPOCH_NS + round((n + delta) * BEAM_NS) for n in beams])
    rows = [triangle(n + delta, samples) for n in beams]
    expected = [nod.pitch_min + SPAN / samples * float(row) for row in rows]
    # Times are whole nanoseconds: up to half a one off.
    np.testing.assert_allclose(nod.pitch(times_ns), expected, rtol=0, atol=0.51e-9 * nod.speed)


@given(offsets_ns)
def test_an_hour_away_at_absolute_stamps(offset_ns):
    nod = nod_of()
    pitch = nod.pitch(EPOCH_NS + offset_ns)
    assert pitch == pytest.approx(exact_pitch(nod, EPOCH_NS + offset_ns), abs=1e-11)


@given(st.integers(0, 10 * NS_PER_S))
def test_half_a_century_after_the_reference(offset_ns):
    nod = nod_of(reference_time_ns=0)
    expected = exact_pitch(nod, EPOCH_NS + offset_ns)
    # 4.4e9 sweeps and 1.7e18 ns, each with a relative error of 1e-16.
    assert nod.pitch(EPOCH_NS + offset_ns) == pytest.approx(expected, abs=3e-6)


def test_limits_are_met_at_the_reversals():
    nod = nod_of()
    turns_ns = [nod.reversal_time_ns(sweep) for sweep in range(-3, 4)]
    low, high = nod.pitch_min, nod.pitch_max
    expected = [high, low, high, low, high, low, high]
    np.testing.assert_allclose(
        nod.pitch(np.array(turns_ns)), expected, rtol=0, atol=1e-9 * nod.speed
    )
    assert nod.reversal_time_ns(0) == nod.reference_time_ns


@given(nods, offsets_ns)
def test_velocity_is_the_slope_of_the_pitch(nod, offset_ns):
    time_ns = nod.reference_time_ns + offset_ns
    step_ns = round(nod.sweep_duration * NS_PER_S * 1e-3)
    before, after = nod.pitch(np.array([time_ns - step_ns, time_ns + step_ns]))
    if np.floor(nod.sweeps(time_ns - step_ns)) == np.floor(nod.sweeps(time_ns + step_ns)):
        slope = (after - before) / (2e-9 * step_ns)
        assert nod.velocity(time_ns) == pytest.approx(slope, rel=1e-5)
    assert abs(nod.velocity(time_ns)) == nod.speed


def test_a_turn_belongs_to_the_leg_that_begins():
    nod = Nod(-0.5, 0.5, 2.0, 20_480, EPOCH_NS)
    velocities = nod.velocity(EPOCH_NS + NS_PER_S * np.array([-2, -1, 0, 1, 2, 3, 4]))
    np.testing.assert_array_equal(velocities, [-0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5])


GOOD = {
    'pitch_min': -0.5,
    'pitch_max': 0.5,
    'sweep_duration': 0.4,
    'samples_per_sweep': 4001,
    'reference_time_ns': 0,
}


@pytest.mark.parametrize(
    ('key', 'value', 'limit'),
    [
        ('pitch_min', float('nan'), 'finite'),
        ('pitch_max', float('inf'), 'finite'),
        ('pitch_max', -0.5, 'above pitch_min = -0.5 rad'),
        ('sweep_duration', float('nan'), 'finite'),
        ('sweep_duration', 0.0, 'above 0 s'),
        ('samples_per_sweep', 0, 'at least 1'),
    ],
)
def test_what_is_no_nod_is_named(key, value, limit):
    with pytest.raises(ParameterError) as caught:
        Nod(**{**GOOD, key: value})
    assert (caught.value.key, caught.value.limit) == (key, limit)
    assert str(caught.value) == f"'{key}' must be {limit}, but is {value!r}"
