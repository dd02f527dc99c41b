"""Joint states of a joint of ros2_control: which ones are believed."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.dynamics import Dynamics
from nodlidar_common.nod import Nod
from nodlidar_servo.joint_trajectory.joint_sample import JointSampleFilter, StampError
import numpy as np
import pytest

NAN = math.nan
S = 10**9
T0 = 1_763_900_000 * S
DYNAMICS = Dynamics(50.0, 0.01, 6.0)


def believed(timed, dynamics=DYNAMICS):
    """Return which of some positions, each at a time [ns], are believed."""
    samples = JointSampleFilter(dynamics)
    return [samples.add(time_ns, pitch, NAN) is not None for time_ns, pitch in timed]


def with_strays(stray, every):
    """Return two seconds of a nod of 100 Hz with strays between, and which these are."""
    nod = Nod(-0.6, 0.6, 0.7, 4001, T0)
    timed = []
    for k in range(200):
        timed.append((T0 + k * S // 100, nod.pitch(T0 + k * S // 100), False))
        if k % every == every - 1:
            timed.append((T0 + k * S // 100 + S // 200, stray, True))
    return [each[:2] for each in timed], [each[2] for each in timed]


@pytest.mark.parametrize('stray', [2.0, -1.5, 3.14, 1e3, 1e300, math.inf, NAN])
@pytest.mark.parametrize('every', [100, 5, 1])
def test_a_position_that_the_joint_cannot_have_reached_is_refused_and_no_other(stray, every):
    timed, are_strays = with_strays(stray, every)
    samples = JointSampleFilter(DYNAMICS)
    found = [samples.add(time_ns, pitch, NAN) is not None for time_ns, pitch in timed]
    assert found == [not is_stray for is_stray in are_strays]
    assert samples.refused == sum(are_strays)


@pytest.mark.parametrize('rate', [10, 50, 100, 1000])
@pytest.mark.parametrize('jump', [0.5, -1.4, 2.9])
@pytest.mark.parametrize('acceleration', [1.0, 50.0])
def test_a_jump_that_lasts_is_believed_within_a_fifth_of_a_second(rate, jump, acceleration):
    timed = [(T0 + k * S // rate, 0.1 if k < rate else 0.1 + jump) for k in range(2 * rate)]
    found = believed(timed, Dynamics(acceleration, 0.01, 6.0))
    assert all(found[:rate])
    assert all(found[rate + math.ceil(rate / 5) :])


@given(
    rate=st.sampled_from([10, 30, 100, 500, 1000]),
    acceleration=st.floats(5.0, 300.0),
    jitter=st.floats(0.0, 0.003),
    seed=st.integers(0, 2**32 - 1),
)
def test_whatever_a_joint_does_within_its_dynamics_is_believed(rate, acceleration, jitter, seed):
    """It accelerates at random; stamps jitter by up to 3 ms, but keep their order."""
    rng, step = np.random.default_rng(seed), 0.001
    wanted = np.repeat(rng.choice([-1.0, 0.0, 1.0], 100), 20) * acceleration * step
    velocity = np.empty(len(wanted))
    speed = 0.0
    for k, change in enumerate(wanted):
        speed = velocity[k] = min(max(speed + change, -6.0), 6.0)
    pitch = np.cumsum(velocity) * step
    taken = np.arange(0, len(pitch), 1000 // rate)
    late_ns = (rng.uniform(-jitter, jitter, len(taken)) * S).astype(int)
    times_ns = np.sort(T0 + taken * (S // 1000) + late_ns)
    timed = [*zip(times_ns.tolist(), pitch[taken].tolist(), strict=True)]
    samples = JointSampleFilter(Dynamics(acceleration, 0.01, 6.0))
    for each in timed:
        samples.add(*each, NAN)
    assert samples.refused == 0


@given(velocities=st.lists(st.floats(), min_size=2, max_size=20))
def test_no_velocity_is_one_that_the_joint_cannot_have(velocities):
    samples = JointSampleFilter(DYNAMICS)
    for k, velocity in enumerate(velocities):
        sample = samples.add(T0 + k * S // 100, 0.02 * k, velocity)
        mean = pytest.approx(2.0 if k else 0.0)
        assert sample.velocity == (velocity if abs(velocity) <= 7.2 else mean)


def test_after_a_restart_the_joint_may_be_anywhere():
    samples = JointSampleFilter(DYNAMICS)
    samples.add(T0, 0.1, 0.0)
    samples.restart()
    assert samples.latest is None
    assert samples.add(T0 + 1, 1.4, NAN).velocity == 0.0


@given(
    error=st.floats(-0.5, 0.5),
    rate=st.sampled_from([3.0, 10.0, 30.0, 100.0, 1000.0]),
    send_rate=st.sampled_from([2.0, 10.0, 50.0]),
    travel=st.floats(0.0, 0.02),
)
def test_only_stamps_that_must_be_wrong_are_called_so(error, rate, send_rate, travel):
    """Cycles take what arrived since the one before; slow publishers are no fault."""
    stamps, last = StampError(), -1
    for cycle in range(1, 60):
        now = 1.0 + cycle / send_rate
        newest = math.floor((now - travel) * rate)
        if newest == last:
            continue
        last = newest
        stamps.add(now - (newest / rate - error), 1.0 / send_rate)
    if abs(error) <= 0.02:
        assert stamps.seconds == 0.0
    if abs(stamps.seconds) > 0.0:
        assert 0.05 < abs(stamps.seconds) <= abs(error + travel) + 1e-9
    if error > 0.06 + 1.0 / send_rate or error < -0.08 - 1.0 / send_rate:
        assert stamps.seconds != 0.0
