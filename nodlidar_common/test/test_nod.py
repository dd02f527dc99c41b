from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NodTrajectory, NS_PER_S
import numpy as np
import pytest

BEAMS = 1024
BEAM_NS = Fraction(NS_PER_S, 10 * BEAMS)  # ten revolutions a second
EPOCH_NS = 1_700_000_000 * NS_PER_S
SPAN = 1.2272


def nod(samples=4001, reference_time_ns=EPOCH_NS, pitch_min=-SPAN / 2, span=SPAN):
    return NodTrajectory(
        pitch_min=pitch_min,
        pitch_max=pitch_min + span,
        sweep_duration=float(samples * BEAM_NS / NS_PER_S),
        samples_per_sweep=samples,
        reference_time_ns=reference_time_ns,
    )


def triangle(m, samples):
    """tri(m) of the model."""
    return samples - abs(m % (2 * samples) - samples)


def exact_pitch(trajectory, time_ns):
    """The pitch by exact rational arithmetic on the trajectory's own numbers."""
    sweeps = Fraction(time_ns - trajectory.reference_time_ns) / (
        Fraction(trajectory.sweep_duration) * NS_PER_S
    )
    return trajectory.pitch_min + trajectory.span * float(triangle(sweeps, 1))


nods = st.builds(
    nod,
    samples=st.integers(100, 20_000),
    reference_time_ns=st.integers(0, 2 * EPOCH_NS),
    pitch_min=st.floats(-1.5, 1.0),
    span=st.floats(0.01, 2.0),
)
offsets_ns = st.integers(-3600 * NS_PER_S, 3600 * NS_PER_S)


@given(nods, offsets_ns)
def test_pitch_within_its_limits(trajectory, offset_ns):
    pitch = trajectory.pitch(trajectory.reference_time_ns + offset_ns)
    assert trajectory.pitch_min <= pitch <= trajectory.pitch_max + 1e-15


@given(nods, offsets_ns, st.integers(-50, 50))
def test_it_repeats_after_two_sweeps(trajectory, offset_ns, periods):
    time_ns = trajectory.reference_time_ns + offset_ns
    later_ns = trajectory.reversal_time_ns(2 * periods) + offset_ns
    rounding = trajectory.speed * 1e-9
    assert trajectory.pitch(later_ns) == pytest.approx(trajectory.pitch(time_ns), abs=2 * rounding)


@pytest.mark.parametrize('samples', [1001, 3000, 4001, 7987])
@pytest.mark.parametrize('delta', [Fraction(0), Fraction(1, 4), Fraction(1, 2)])
def test_pitch_of_each_beam_is_that_of_the_model(samples, delta):
    beams = list(range(-2 * samples, 2 * samples, 7))
    trajectory = nod(samples)
    times_ns = np.array([EPOCH_NS + round((n + delta) * BEAM_NS) for n in beams])
    rows = [triangle(n + delta, samples) for n in beams]
    expected = [trajectory.pitch_min + SPAN / samples * float(row) for row in rows]
    # Times are whole nanoseconds: up to half a one off.
    np.testing.assert_allclose(
        trajectory.pitch(times_ns), expected, rtol=0, atol=0.51e-9 * trajectory.speed
    )


@given(offsets_ns)
def test_an_hour_away_at_absolute_stamps(offset_ns):
    trajectory = nod()
    pitch = trajectory.pitch(EPOCH_NS + offset_ns)
    assert pitch == pytest.approx(exact_pitch(trajectory, EPOCH_NS + offset_ns), abs=1e-11)


@given(st.integers(0, 10 * NS_PER_S))
def test_half_a_century_after_the_reference(offset_ns):
    trajectory = nod(reference_time_ns=0)
    expected = exact_pitch(trajectory, EPOCH_NS + offset_ns)
    # 4.4e9 sweeps and 1.7e18 ns, each with a relative error of 1e-16.
    assert trajectory.pitch(EPOCH_NS + offset_ns) == pytest.approx(expected, abs=3e-6)


def test_limits_are_met_at_the_turns():
    trajectory = nod()
    turns_ns = [trajectory.reversal_time_ns(sweep) for sweep in range(-3, 4)]
    low, high = trajectory.pitch_min, trajectory.pitch_max
    expected = [high, low, high, low, high, low, high]
    np.testing.assert_allclose(
        trajectory.pitch(np.array(turns_ns)), expected, rtol=0, atol=1e-9 * trajectory.speed
    )
    assert trajectory.reversal_time_ns(0) == trajectory.reference_time_ns


@given(nods, offsets_ns)
def test_velocity_is_the_slope_of_the_pitch(trajectory, offset_ns):
    time_ns = trajectory.reference_time_ns + offset_ns
    step_ns = round(trajectory.sweep_duration * NS_PER_S * 1e-3)
    before, after = trajectory.pitch(np.array([time_ns - step_ns, time_ns + step_ns]))
    if np.floor(trajectory.sweeps(time_ns - step_ns)) == np.floor(
        trajectory.sweeps(time_ns + step_ns)
    ):
        slope = (after - before) / (2e-9 * step_ns)
        assert trajectory.velocity(time_ns) == pytest.approx(slope, rel=1e-5)
    assert abs(trajectory.velocity(time_ns)) == trajectory.speed


def test_a_turn_belongs_to_the_leg_that_begins():
    trajectory = NodTrajectory(-0.5, 0.5, 2.0, 20_480, EPOCH_NS)
    velocities = trajectory.velocity(EPOCH_NS + NS_PER_S * np.array([-2, -1, 0, 1, 2, 3, 4]))
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
def test_what_is_no_trajectory_is_named(key, value, limit):
    with pytest.raises(ParameterError) as caught:
        NodTrajectory(**{**GOOD, key: value})
    assert (caught.value.key, caught.value.limit) == (key, limit)
    assert str(caught.value) == f"'{key}' must be {limit}, but is {value!r}"
