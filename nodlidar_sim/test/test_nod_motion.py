import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_sim.world.nod_motion import PiecewiseMotion, triangle_motion
import numpy as np
import pytest

MS = 1_000_000
S = 1_000_000_000
NOD = Nod(-0.6136, 0.6136, 0.3907, 4001, reference_time_ns=1_700_000_000 * S)
START_NS = NOD.reference_time_ns - 3 * S
TIMES_NS = START_NS + np.arange(0, 6000) * MS


def assert_moves_as_it_says(motion, times_ns, acceleration, speed):
    """Position follows velocity (trapezoid rule), and neither jumps nor breaks its limit."""
    position, velocity = motion.position(times_ns), motion.velocity(times_ns)
    step = np.diff(times_ns) / S
    mean = (velocity[1:] + velocity[:-1]) / 2.0
    np.testing.assert_allclose(np.diff(position), mean * step, atol=acceleration * step.max() ** 2)
    assert np.abs(np.diff(velocity)).max() <= acceleration * step.max() * (1.0 + 1e-9)
    assert np.abs(velocity).max() <= speed * (1.0 + 1e-7)  # the knots are whole nanoseconds


def test_pieces_of_constant_acceleration_are_exact():
    motion = PiecewiseMotion(
        np.array([0, 2 * S]), np.array([1.0, 7.0]), np.array([2.0, 4.0]), np.array([1.0, -4.0])
    )
    times = np.array([0, 1 * S, 2 * S, 3 * S])
    np.testing.assert_allclose(motion.position(times), [1.0, 3.5, 7.0, 9.0])
    np.testing.assert_allclose(motion.velocity(times), [2.0, 3.0, 4.0, 0.0])


def test_before_the_first_piece_there_is_no_answer():
    motion = PiecewiseMotion(np.array([S]), np.zeros(1), np.zeros(1), np.zeros(1))
    with pytest.raises(ParameterError, match=r"'times_ns' must be at or after .* 1000000000 ns"):
        motion.position(np.array([2 * S, S - 1]))


def test_on_the_legs_the_nod_is_where_it_is_commanded():
    motion = triangle_motion(NOD, START_NS, int(TIMES_NS[-1]))
    half_blend = NOD.speed / 200.0
    into_leg = np.mod(NOD.sweeps(TIMES_NS), 1.0) * NOD.sweep_duration
    on_leg = (into_leg > half_blend) & (into_leg < NOD.sweep_duration - half_blend)
    assert 0.8 < on_leg.mean() < 0.95
    commanded = NOD.pitch(TIMES_NS[on_leg])
    np.testing.assert_allclose(motion.position(TIMES_NS[on_leg]), commanded, atol=1e-8)
    np.testing.assert_allclose(
        motion.velocity(TIMES_NS[on_leg]), NOD.velocity(TIMES_NS[on_leg]), rtol=1e-8
    )


def test_it_turns_at_the_commanded_instants_short_of_the_limits():
    motion = triangle_motion(NOD, START_NS, int(TIMES_NS[-1]))
    turns = np.array([NOD.reversal_time_ns(sweep) for sweep in (-2, -1, 0, 1, 2)])
    short = NOD.speed**2 / (2.0 * 200.0)
    low, high = NOD.pitch_min + short, NOD.pitch_max - short
    np.testing.assert_allclose(motion.position(turns), [low, high, low, high, low], atol=1e-8)
    np.testing.assert_allclose(motion.velocity(turns), 0.0, atol=1e-6)
    assert motion.position(TIMES_NS).min() >= low - 1e-9
    assert motion.position(TIMES_NS).max() <= high + 1e-9


@given(st.floats(0.01, 0.3), st.floats(0.1, 1.0), st.floats(0.0, 0.005), st.floats(50.0, 400.0))
def test_a_triangle_keeps_its_limits(share, duration, jitter_share, acceleration):
    span = share * acceleration * duration**2  # at 0.5 it would only reverse
    jitter = jitter_share * duration
    nod = Nod(-0.3, -0.3 + span, duration, 4001, 0)
    end_ns = 8 * S
    motion = triangle_motion(nod, 0, end_ns, acceleration, jitter, seed=3)
    times = np.arange(0, end_ns, MS // 2)
    fastest = span / (duration - 10.0 * jitter)
    assert_moves_as_it_says(motion, times, acceleration, fastest)
    assert motion.position(times).min() >= nod.pitch_min
    assert motion.position(times).max() <= nod.pitch_max


def test_jitter_moves_the_reversals_by_white_noise():
    """Turn k is the zero of the velocity; against the command it is off by N(0, 2 ms)."""
    count = 2000
    end_ns = NOD.reversal_time_ns(count)
    motion = triangle_motion(NOD, NOD.reference_time_ns, end_ns, jitter=2e-3, seed=5)
    turning = np.flatnonzero(np.diff(np.sign(motion.velocities[motion.accelerations == 0.0])) != 0)
    assert len(turning) >= count
    blends = np.flatnonzero(motion.accelerations != 0.0)[2:-2]
    to_zero = -motion.velocities[blends] / motion.accelerations[blends]
    zero_ns = motion.starts_ns[blends] + to_zero * S
    nearest = np.rint(NOD.sweeps(zero_ns.astype(np.int64)))
    errors = (zero_ns - [NOD.reversal_time_ns(int(sweep)) for sweep in nearest]) / S
    assert errors.std() == pytest.approx(2e-3, rel=0.1)
    assert abs(errors.mean()) < 4.0 * 2e-3 / math.sqrt(count)
    assert abs(np.corrcoef(errors[1:], errors[:-1])[0, 1]) < 0.1


def test_jitter_is_drawn_by_seed():
    one, same, other = (
        triangle_motion(NOD, START_NS, int(TIMES_NS[-1]), jitter=1e-3, seed=seed).position(
            TIMES_NS
        )
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-3


def test_a_sweep_too_short_to_reverse_in_is_refused():
    nod = Nod(-0.6, 0.6, 0.1, 1024, 0)
    with pytest.raises(ParameterError, match=r'sweep_duration.*200\.0 rad/s\^2.*0\.1'):
        triangle_motion(nod, 0, S)
