"""The servo's nod at the edge of what mount and motor can do (docs/extremes.md)."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.dynamics import arrival_speed, check_nod, Dynamics, shortest_sweep
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.tracking import NodTracker
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.nod.nod_commands import NodCommands
import numpy as np
import pytest
from test_tracking import follow, Measured

S = 1_000_000_000
START_NS = 1_800_000_000 * S
RX24F = MODELS['RX-24F']
ACCELERATION = 200.0
DYNAMICS = Dynamics(ACCELERATION, RX24F.speed_unit, RX24F.fastest)
LOW, HIGH = -0.8, 0.8


def nod_of(span, duration):
    return Nod(-span / 2, span / 2, duration, 4001, START_NS)


def longest_sweep(span):
    """Return the time at the lowest speed that the register can tell."""
    return span / DYNAMICS.min_speed


@pytest.mark.parametrize('key', ['pitch_min', 'pitch_max'])
def test_a_nod_to_the_very_limits_of_the_mount_is_accepted_and_beyond_refused_by_name(key):
    check_nod(Nod(LOW, HIGH, 0.5, 4001, 0), LOW, HIGH, DYNAMICS)
    limits = {'pitch_min': LOW, 'pitch_max': HIGH}
    limits[key] = math.nextafter(limits[key], 2.0 * limits[key])
    with pytest.raises(
        ParameterError, match=f"'{key}' must be between -0.8 and 0.8 rad, the limits"
    ):
        check_nod(
            Nod(**limits, sweep_duration=0.5, samples_per_sweep=1, reference_time_ns=0),
            LOW,
            HIGH,
            DYNAMICS,
        )


@pytest.mark.parametrize('span', [0.02, 0.2, 1.2272, 1.6])
def test_the_slowest_and_the_fastest_sweep_are_just_accepted(span):
    for duration in (longest_sweep(span) * 0.999_999, shortest_sweep(span, DYNAMICS) * 1.000_001):
        check_nod(nod_of(span, duration), LOW, HIGH, DYNAMICS)
    for duration in (longest_sweep(span) * 1.000_001, shortest_sweep(span, DYNAMICS) * 0.999_999):
        with pytest.raises(ParameterError, match=r"'sweep_duration' must be at (most|least)"):
            check_nod(nod_of(span, duration), LOW, HIGH, DYNAMICS)


@pytest.mark.parametrize('duration', [1e-9, 1e-3, 0.4, 3600.0])
@pytest.mark.parametrize('span', [5e-324, 1e-300, 1e-12, 1e-6])
def test_a_nod_of_hardly_any_span_is_refused(span, duration):
    nod = Nod(0.0, span, duration, 4001, 0)
    with pytest.raises(ParameterError, match=r"'sweep_duration' must be at (most|least)"):
        check_nod(nod, LOW, HIGH, DYNAMICS)


def farthest_off_at_reversals(nod, legs):
    """Return how far the servo is from the limits where legs begin, in encoder steps."""
    motion = follow(nod, legs[-1] + 1)
    instants = np.array([nod.reversal_time_ns(leg) for leg in legs])
    limits = np.where(np.array(legs) % 2 == 0, nod.pitch_min, nod.pitch_max)
    return np.abs(motion.position(instants) - limits).max() / RX24F.tick_angle


@pytest.mark.parametrize('span', [0.02, 0.2, 1.2272, 1.6])
def test_a_hundredth_above_the_fastest_sweep_reversals_are_in_time(span):
    nod = nod_of(span, shortest_sweep(span, DYNAMICS) * 1.01)
    assert farthest_off_at_reversals(nod, range(10, 60)) < 0.6


@pytest.mark.parametrize('span', [0.2, 1.6])
def test_at_the_fastest_sweep_reversals_are_in_time_or_the_servo_says_that_it_is_too_slow(span):
    nod = nod_of(span, shortest_sweep(span, DYNAMICS) * 1.000_001)
    tracker = NodTracker(nod, DYNAMICS)
    late_ns = nod.reversal_time_ns(4) + round(0.6 * nod.sweep_duration * S)
    drive = tracker.step(late_ns, Measured(late_ns, nod.pitch_min, 0.0))
    assert drive.saturated
    assert drive.speed <= DYNAMICS.max_speed


@pytest.mark.parametrize('span', [0.02, 0.1])
def test_at_the_slowest_sweep_reversals_are_in_time(span):
    nod = nod_of(span, longest_sweep(span) * 0.999_999)
    assert farthest_off_at_reversals(nod, range(2, 6)) < 0.6


def test_no_nod_is_accepted_that_the_speed_register_cannot_tell():
    """The motor turns by 126 rpm without load, its register ends at 1023 x 0.111 rpm."""
    register = 1023 * 0.111 * math.tau / 60
    assert RX24F.fastest == pytest.approx(register)
    assert MODELS['MX-28'].fastest == pytest.approx(55 * math.tau / 60)
    commands = NodCommands(ServoConfig())
    commands.accept(nod_of(1.2272, 1.2272 / register + register / ACCELERATION + 1e-6), START_NS)
    with pytest.raises(ParameterError, match='the fastest of the servo'):
        commands.accept(nod_of(1.2272, 1.2272 / 12.5 + 12.5 / ACCELERATION), START_NS)


times = st.integers(-3600 * S, 3600 * S) | st.integers(-2000, 2000)


@given(
    span=st.floats(0.01, 1.6), slow=st.floats(0.0, 1.0), now=times, leg=st.integers(0, 20_000),
    age=st.integers(0, S), pitch=st.floats(-2.7, 2.7), velocity=st.floats(-13.0, 13.0),
)  # fmt: skip
def test_wherever_the_servo_is_it_is_told_a_goal_and_a_speed_that_it_has(
    span, slow, now, leg, age, pitch, velocity
):
    shortest, longest = shortest_sweep(span, DYNAMICS), longest_sweep(span)
    nod = nod_of(span, shortest * 1.001 + slow * 0.998 * (longest - shortest))
    check_nod(nod, LOW, HIGH, DYNAMICS)
    tracker = NodTracker(nod, DYNAMICS)
    now_ns = nod.reversal_time_ns(leg) + now
    for step_ns in (0, 10_000_000):
        drive = tracker.step(now_ns + step_ns, Measured(now_ns + step_ns - age, pitch, velocity))
        assert drive.goal in (nod.pitch_min, nod.pitch_max)
        assert 0.0 <= drive.speed <= DYNAMICS.max_speed


@given(
    st.sampled_from([0.0, 5e-324, 1e-12, 1.6]), st.sampled_from([-1e-6, 0.0, 1e-9, 0.4, 3600.0]),
    st.sampled_from([-13.0, 0.0, 1e-12, 13.0]),
)  # fmt: skip
def test_the_speed_to_arrive_with_is_none_or_a_number_and_never_nan(distance, duration, velocity):
    speed = arrival_speed(distance, duration, velocity, ACCELERATION)
    assert not math.isnan(speed)
    if math.isfinite(speed) and speed > velocity >= 0.0 and duration > 0.0:
        change = (speed - velocity) ** 2 / (2 * ACCELERATION) + speed**2 / (2 * ACCELERATION)
        assert speed * duration == pytest.approx(distance + change, rel=1e-6, abs=1e-6)
