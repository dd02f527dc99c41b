import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.ideal_servo import IdealServo, trapezoid
import numpy as np
import pytest

MS = 1_000_000
S = 1_000_000_000
NOW = 1_700_000_000 * S
ACCELERATION = 200.0


def sampled(motion, start_ns, duration_ms, step_ns=MS // 10):
    times = np.arange(start_ns, start_ns + duration_ms * MS, step_ns)
    return times, motion.position(times), motion.velocity(times)


def test_it_rests_until_the_first_goal():
    motion = IdealServo(position=0.3)
    times = np.array([0, NOW, NOW + 10 * S])
    np.testing.assert_array_equal(motion.position(times), 0.3)
    np.testing.assert_array_equal(motion.velocity(times), 0.0)


def test_a_long_way_is_a_trapezoid():
    """Up to 2 rad/s in 10 ms over 10 mm, cruise, and down the same way: 1 rad takes 510 ms."""
    motion = IdealServo()
    motion.set_goal(NOW, 1.0, 2.0)
    at = NOW + np.array([0, 5, 10, 260, 500, 505, 510, 600]) * MS
    np.testing.assert_allclose(
        motion.position(at), [0.0, 0.0025, 0.01, 0.51, 0.99, 0.9975, 1.0, 1.0], atol=1e-9
    )
    np.testing.assert_allclose(
        motion.velocity(at), [0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, 0.0], atol=1e-9
    )


def test_a_short_way_is_a_triangle():
    """0.02 rad at 200 rad/s^2: half of it takes sqrt(0.02 / 200) = 10 ms, at most 2 rad/s."""
    motion = IdealServo()
    motion.set_goal(NOW, -0.02, 100.0)
    at = NOW + np.array([10, 20, 30]) * MS
    np.testing.assert_allclose(motion.position(at), [-0.01, -0.02, -0.02], atol=1e-9)
    np.testing.assert_allclose(motion.velocity(at), [-2.0, 0.0, 0.0], atol=1e-9)


def test_a_goal_behind_the_braking_distance_is_overrun_and_come_back_to():
    motion = IdealServo()
    motion.set_goal(NOW, 1.0, 4.0)
    turn_ns = NOW + 100 * MS
    here = float(motion.position(np.array([turn_ns]))[0])
    motion.set_goal(turn_ns, here + 0.01, 4.0)
    _, position, _ = sampled(motion, turn_ns, 200)
    assert position.max() == pytest.approx(here + 4.0**2 / (2.0 * ACCELERATION))
    assert position[-1] == pytest.approx(here + 0.01)


def test_a_lower_speed_limit_is_come_down_to():
    motion = IdealServo()
    motion.set_goal(NOW, 1.0, 4.0)
    motion.set_goal(NOW + 100 * MS, 1.0, 1.0)
    at = NOW + np.array([100, 115, 200]) * MS
    np.testing.assert_allclose(motion.velocity(at), [4.0, 1.0, 1.0], atol=1e-6)


goals = st.tuples(st.integers(0, 300), st.floats(-1.0, 1.0), st.floats(0.05, 12.0))


@given(st.lists(goals, min_size=1, max_size=12))
def test_for_any_goals_it_keeps_its_limits_and_arrives(orders):
    motion, now, fastest = IdealServo(), NOW, 0.0
    for pause_ms, goal, speed_limit in orders:
        now += pause_ms * MS
        motion.set_goal(now, goal, speed_limit)
        fastest = max(fastest, speed_limit)
    last_ms = math.ceil(2.0 / orders[-1][2] * 1000.0) + 500
    times, position, velocity = sampled(motion, max(NOW, now - S), 1000 + last_ms, MS)
    step = 1e-3
    assert np.abs(velocity).max() <= fastest * (1.0 + 1e-6)
    assert np.abs(np.diff(velocity)).max() <= ACCELERATION * step * (1.0 + 1e-6) + 1e-6
    mean = (velocity[1:] + velocity[:-1]) / 2.0
    np.testing.assert_allclose(np.diff(position), mean * step, atol=ACCELERATION * step**2)
    np.testing.assert_allclose(position[times > now + last_ms * MS], orders[-1][1], atol=1e-7)


@given(st.floats(-2.0, 2.0), st.floats(-10.0, 10.0), st.floats(0.05, 12.0))
def test_a_profile_covers_its_distance_and_ends_at_rest(distance, velocity, speed_limit):
    position, speed = 0.0, velocity
    for piece in trapezoid(distance, velocity, speed_limit, ACCELERATION):
        assert piece.duration >= 0.0
        assert abs(piece.acceleration) in (0.0, ACCELERATION)
        position += speed * piece.duration + piece.acceleration * piece.duration**2 / 2.0
        speed += piece.acceleration * piece.duration
        assert abs(speed) <= max(speed_limit, abs(velocity)) + 1e-9
    assert position == pytest.approx(distance, abs=1e-9)
    assert speed == pytest.approx(0.0, abs=1e-9)


def test_what_is_past_does_not_change():
    motion = IdealServo()
    motion.set_goal(NOW, 1.0, 3.0)
    times, position, _ = sampled(motion, NOW, 150)
    motion.set_goal(NOW + 150 * MS, -1.0, 3.0)
    np.testing.assert_array_equal(motion.position(times), position)


def test_the_same_goal_again_changes_nothing():
    one, repeated = IdealServo(), IdealServo()
    one.set_goal(NOW, 0.8, 3.0)
    for milliseconds in range(0, 400, 7):
        repeated.set_goal(NOW + milliseconds * MS, 0.8, 3.0)
    _, expected, _ = sampled(one, NOW, 500)
    _, position, _ = sampled(repeated, NOW, 500)
    np.testing.assert_allclose(position, expected, atol=1e-6)


def test_without_torque_it_brakes_and_stays():
    motion = IdealServo()
    motion.set_goal(NOW, 1.0, 4.0)
    motion.brake(NOW + 100 * MS)
    at = NOW + np.array([100, 110, 120, 5000]) * MS
    np.testing.assert_allclose(motion.velocity(at), [4.0, 2.0, 0.0, 0.0], atol=1e-9)
    position = motion.position(at)
    np.testing.assert_allclose(position - position[0], [0.0, 0.03, 0.04, 0.04], atol=1e-8)


def test_the_past_is_kept_for_the_history():
    motion = IdealServo(history=2.0)
    for step in range(1000):
        motion.set_goal(NOW + step * 10 * MS, math.sin(step / 10.0), 3.0)
    last = NOW + 9990 * MS
    assert np.isfinite(motion.position(np.array([last - 2 * S]))).all()
    with pytest.raises(ParameterError, match='times_ns'):
        motion.position(np.array([last - 3 * S]))


def test_jitter_delays_each_reversal_once():
    exact, late = IdealServo(), IdealServo(jitter=3e-3, seed=1)
    for motion in (exact, late):
        motion.set_goal(NOW, 1.0, 3.0)
        for milliseconds in range(200, 300, 2):  # repeatedly, as by a node
            motion.set_goal(NOW + milliseconds * MS, -1.0, 3.0)
    delay = abs(np.random.default_rng(1).normal(0.0, 3e-3))
    times, _, velocity = sampled(late, NOW + 200 * MS, 100, step_ns=10_000)
    begins_ns = times[np.flatnonzero(velocity < 3.0 - 1e-3)[0]] - NOW - 200 * MS
    assert begins_ns / S == pytest.approx(delay, abs=3e-5)
    shifted = exact.velocity(times) - late.velocity(times + round(delay * S))
    np.testing.assert_allclose(shifted, 0.0, atol=1e-5)


@pytest.mark.parametrize(
    ('goal', 'speed', 'key'),
    [(math.nan, 1.0, 'goal'), (0.1, 0.0, 'speed_limit'), (0.1, math.nan, 'speed_limit')],
)
def test_a_goal_that_is_none_is_refused(goal, speed, key):
    with pytest.raises(ParameterError) as error:
        IdealServo().set_goal(NOW, goal, speed)
    assert error.value.key == key
