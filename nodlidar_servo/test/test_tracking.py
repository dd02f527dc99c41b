from dataclasses import dataclass, replace
import itertools
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.dynamics import arrival_speed, check_nod, Dynamics, shortest_sweep
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import NodTracker
from nodlidar_servo.models.models import MODELS, PitchScale
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest

START_NS = 1_800_000_000_000_000_000
BEAM_PERIOD = 0.1 / 1024
RX24F = MODELS['RX-24F']
SCALE = PitchScale(RX24F, 512, False)
ACCELERATION = 200.0
DYNAMICS = Dynamics(ACCELERATION, RX24F.speed_unit, RX24F.max_speed)


@dataclass
class Measured:
    stamp_ns: int
    pitch: float
    velocity: float


def nod_of(samples=4001, span=1.2272):
    return Nod(-span / 2, span / 2, samples * BEAM_PERIOD, samples, START_NS)


def measure(motion, time_ns):
    """Return what the servo would report: whole ticks and whole speed counts."""
    times = np.array([time_ns])
    speed = round(float(motion.velocity(times)[0]) / RX24F.speed_unit) * RX24F.speed_unit
    pitch = SCALE.pitch(SCALE.tick(float(motion.position(times)[0])))
    return Measured(time_ns, pitch, speed)


def follow(
    nod, legs, start=0.0, rate=100.0, acceleration=ACCELERATION, begin=0.3, tuned=lambda nod: nod
):
    """Return the motion of a servo with coarse registers that follows a nod from rest.

    In every fifth cycle the nod is replaced by a tuned one.
    """
    motion = IdealServo(start, acceleration, history=1e6)
    tracker = NodTracker(nod, DYNAMICS)

    def steer(time_ns, sample):
        drive = tracker.step(time_ns, sample)
        assert tracker.nod.pitch_min <= drive.goal <= tracker.nod.pitch_max
        speed = RX24F.speed_counts(drive.speed) * RX24F.speed_unit
        motion.set_goal(time_ns, SCALE.pitch(SCALE.tick(drive.goal)), speed)

    time_ns = START_NS + round(begin * nod.sweep_duration * NS_PER_S)
    for cycle in itertools.count():
        if time_ns >= nod.reversal_time_ns(legs):
            break
        if cycle % 5 == 0:
            tracker.nod = tuned(nod)
        sample = measure(motion, time_ns)
        steer(time_ns, sample)
        turn_ns = tracker.next_reversal_ns(time_ns)
        next_ns = time_ns + round(NS_PER_S / rate)
        if turn_ns < next_ns:
            steer(turn_ns, sample)
        time_ns = next_ns
    return motion


def from_rest_to_rest(nod, times_ns):
    """Return the pitch of legs of constant acceleration, speed and braking that meet the turns.

    The speed v with v T = span + v^2 / a, in closed form.
    """
    reach = ACCELERATION * nod.sweep_duration
    speed = (reach - math.sqrt(reach**2 - 4 * ACCELERATION * nod.span)) / 2
    sweeps = nod.sweeps(times_ns)
    elapsed = np.mod(sweeps, 1.0) * nod.sweep_duration
    rest = nod.sweep_duration - elapsed
    way = np.select(
        [elapsed < speed / ACCELERATION, rest < speed / ACCELERATION],
        [ACCELERATION / 2 * elapsed**2, nod.span - ACCELERATION / 2 * rest**2],
        speed * (elapsed - speed / ACCELERATION / 2),
    )
    return np.where(np.mod(np.floor(sweeps), 2) == 0, nod.pitch_min + way, nod.pitch_max - way)


def times_of(nod, first, last):
    return np.arange(nod.reversal_time_ns(first), nod.reversal_time_ns(last), 1_000_000)


def travelled(speed, velocity, duration):
    """Return how far a servo gets that changes to a speed, cruises and brakes to rest in time."""
    change = abs(speed - velocity) / ACCELERATION
    brake = speed / ACCELERATION
    cruise = duration - change - brake
    return (speed + velocity) / 2 * change + speed * cruise + speed / 2 * brake, cruise


@given(speed=st.floats(0.1, 12.0), velocity=st.floats(-12.0, 12.0), cruise=st.floats(0.001, 2.0))
def test_arrival_speed_undoes_the_motion_that_it_plans(speed, velocity, cruise):
    duration = cruise + abs(speed - velocity) / ACCELERATION + speed / ACCELERATION
    distance, _ = travelled(speed, velocity, duration)
    if distance < 0.0:  # it is driving away and would not come back this far
        return
    found = arrival_speed(distance, duration, min(velocity, speed), ACCELERATION)
    if velocity <= speed:
        assert found == pytest.approx(speed, rel=1e-6, abs=1e-6)


def test_arrival_speed_of_a_servo_that_is_too_fast_allows_for_braking_only():
    speed = arrival_speed(1.0, 0.5, 9.0, ACCELERATION)
    assert speed * 0.5 == pytest.approx(1.0 + speed**2 / (2 * ACCELERATION))


@given(
    speed=st.floats(0.1, 12.0), slower=st.floats(0.0, 1.0), velocity=st.floats(-12.0, 12.0),
    cruise=st.floats(0.001, 2.0),
)  # fmt: skip
def test_arrival_speed_allows_for_a_final_speed(speed, slower, velocity, cruise):
    velocity, final = min(velocity, speed), slower * speed
    change, brake = (speed - velocity) / ACCELERATION, (speed - final) / ACCELERATION
    way = (speed + velocity) / 2 * change + speed * cruise + (speed + final) / 2 * brake
    if way >= 0.0:  # it gets there, and not back to where it was
        found = arrival_speed(way, change + cruise + brake, velocity, ACCELERATION, final)
        assert found == pytest.approx(speed, rel=1e-6, abs=1e-6)


def test_no_speed_is_high_enough_for_too_little_time():
    assert arrival_speed(1.0, 0.01, 0.0, ACCELERATION) == math.inf
    assert arrival_speed(1.0, -0.01, 0.0, ACCELERATION) == math.inf
    assert arrival_speed(1.0, 0.01, -50.0, ACCELERATION) == math.inf


@pytest.mark.parametrize('samples', [2001, 3001, 4001, 8001])
@pytest.mark.parametrize('rate', [62.0, 100.0])
def test_turns_reach_the_limits_in_time(samples, rate):
    nod = nod_of(samples)
    motion = follow(nod, 40, rate=rate)
    sweeps = range(2, 40)
    turns = np.array([nod.reversal_time_ns(sweep) for sweep in sweeps])
    limits = np.where(np.array(sweeps) % 2 == 0, nod.pitch_min, nod.pitch_max)
    assert np.abs(motion.position(turns) - limits).max() < RX24F.tick_angle


@pytest.mark.parametrize('samples', [2001, 3001, 4001, 8001])
@pytest.mark.parametrize('rate', [62.0, 100.0])
def test_legs_are_the_ideal_ones_from_rest_to_rest(samples, rate):
    nod = nod_of(samples)
    times_ns = times_of(nod, 2, 40)
    error = follow(nod, 40, rate=rate).position(times_ns) - from_rest_to_rest(nod, times_ns)
    assert np.abs(error).max() < 0.004
    assert error.std() < RX24F.tick_angle / math.sqrt(12)  # what a tick alone is off by


def test_the_error_against_the_command_is_what_the_acceleration_makes_inevitable():
    nod = nod_of()
    times_ns = times_of(nod, 2, 40)
    error = np.abs(follow(nod, 40).position(times_ns) - nod.pitch(times_ns))
    middle = np.abs(np.mod(nod.sweeps(times_ns), 1.0) - 0.5) < 0.1
    assert error[middle].max() < 0.010
    assert error.max() < nod.speed**2 / ACCELERATION / 2 * 2.2


def test_a_nod_that_is_tuned_all_the_time_is_followed_as_well():
    nod, rng = nod_of(), np.random.default_rng(1)

    def tuned(nod):
        """Return the nod counted from another turn, off as much as a clock's estimate is."""
        off_ns = nod.reversal_time_ns(2 * int(rng.integers(30))) + round(rng.normal(0.0, 50e3))
        duration = nod.sweep_duration * (1.0 + rng.normal(0.0, 5e-6))
        return replace(nod, sweep_duration=duration, reference_time_ns=off_ns)

    turns = np.array([nod.reversal_time_ns(sweep) for sweep in range(2, 60)])
    limits = np.where(np.arange(2, 60) % 2 == 0, nod.pitch_min, nod.pitch_max)
    motion = follow(nod, 60, tuned=tuned)
    assert np.abs(motion.position(turns) - limits).max() < RX24F.tick_angle
    times_ns = times_of(nod, 2, 60)
    error = motion.position(times_ns) - from_rest_to_rest(nod, times_ns)
    assert np.abs(error).max() < 0.006


@pytest.mark.parametrize('later', [0.0, 1e-6, 1e-4, 4e-3])
def test_a_turn_is_not_taken_back_when_it_is_found_to_be_due_a_little_later(later):
    nod = nod_of()
    tracker = NodTracker(nod, DYNAMICS)
    turn_ns = nod.reversal_time_ns(1)
    assert tracker.step(turn_ns, Measured(turn_ns, 0.61, 0.0)).goal == nod.pitch_min
    tracker.nod = replace(nod, reference_time_ns=nod.reference_time_ns + round(later * NS_PER_S))
    assert tracker.step(turn_ns + 1000, Measured(turn_ns, 0.61, 0.0)).goal == nod.pitch_min
    assert tracker.next_reversal_ns(turn_ns + 1000) == tracker.nod.reversal_time_ns(2)


@pytest.mark.parametrize('real', [100.0, 150.0, 300.0])
def test_turns_stay_in_time_with_another_acceleration_than_expected(real):
    nod = nod_of()
    motion = follow(nod, 40, acceleration=real)
    turns = np.array([nod.reversal_time_ns(sweep) for sweep in range(2, 40)])
    limits = np.where(np.arange(2, 40) % 2 == 0, nod.pitch_min, nod.pitch_max)
    assert np.abs(motion.position(turns) - limits).max() < 2 * RX24F.tick_angle


@pytest.mark.parametrize('start', [-0.8, -0.3, 0.0, 0.6, 0.8])
@pytest.mark.parametrize('begin', [0.01, 0.5, 0.97, 1.4])
def test_from_rest_anywhere_it_joins_the_nod_within_two_legs_and_stays_in_the_mount(start, begin):
    nod = nod_of()
    motion = follow(nod, 8, start=start, begin=begin)
    path = motion.position(times_of(nod, 0, 8))
    tolerance = RX24F.tick_angle / 2
    assert path.min() >= min(start, nod.pitch_min) - tolerance
    assert path.max() <= max(start, nod.pitch_max) + tolerance
    times_ns = times_of(nod, 4, 8)
    error = motion.position(times_ns) - from_rest_to_rest(nod, times_ns)
    assert np.abs(error).max() < 0.004


@pytest.mark.parametrize('side', [-1.0, 1.0])
@pytest.mark.parametrize(('outside', 'time_for_it'), [(0.3, 0.17), (0.2, 0.12), (0.4, 0.2)])
def test_from_outside_it_passes_the_limit_when_the_nod_reverses_there(side, outside, time_for_it):
    nod = nod_of(span=0.8)
    limit, leg = side * 0.4, 1 if side > 0.0 else 2
    begin = leg - time_for_it / nod.sweep_duration
    motion = follow(nod, leg + 2, start=limit + side * outside, begin=begin)
    at_reversal = np.array([nod.reversal_time_ns(leg)])
    assert motion.position(at_reversal)[0] == pytest.approx(limit, abs=0.02)
    assert motion.velocity(at_reversal)[0] == pytest.approx(-side * nod.speed, rel=0.15)
    times_ns = times_of(nod, leg, leg + 2)
    error = np.abs(motion.position(times_ns) - nod.pitch(times_ns))
    assert error.max() < nod.speed**2 / ACCELERATION / 2 * 2.2


def test_the_way_to_the_nod_is_not_faster_than_twice_the_nod():
    nod = nod_of(8001)
    motion = follow(nod, 4, start=-0.6, begin=0.98)
    assert np.abs(motion.velocity(times_of(nod, 0, 4))).max() < 2.0 * nod.speed + RX24F.speed_unit


def test_the_instant_of_a_turn_belongs_to_the_new_leg():
    nod = nod_of()
    tracker = NodTracker(nod, DYNAMICS)
    for sweep in range(50):
        turn_ns = nod.reversal_time_ns(sweep)
        drive = tracker.step(turn_ns, Measured(turn_ns, 0.0, 0.0))
        assert drive.goal == (nod.pitch_max if sweep % 2 == 0 else nod.pitch_min)
        assert tracker.next_reversal_ns(turn_ns) == nod.reversal_time_ns(sweep + 1)


@pytest.mark.parametrize(
    ('key', 'nod'),
    [
        ('pitch_min', Nod(-0.9, 0.5, 0.4, 4001, 0)),
        ('pitch_max', Nod(-0.5, 0.9, 0.4, 4001, 0)),
        ('sweep_duration', Nod(-0.5, 0.5, 0.1, 1001, 0)),  # acceleration
        ('sweep_duration', Nod(-0.5, 0.5, 1e3, 10**7, 0)),  # lowest speed
    ],
)
def test_a_nod_that_cannot_be_done_names_what_is_wrong(key, nod):
    with pytest.raises(ParameterError) as caught:
        check_nod(nod, -0.8, 0.8, DYNAMICS)
    assert caught.value.key == key
    assert caught.value.value == getattr(nod, key)


def test_a_nod_above_the_motors_speed_is_refused():
    slow = Dynamics(ACCELERATION, RX24F.speed_unit, 3.0)
    with pytest.raises(ParameterError, match='sweep_duration'):
        check_nod(nod_of(), -0.8, 0.8, slow)


@given(st.floats(0.01, 1.6), st.floats(0.5, 13.0))
def test_the_shortest_sweep_is_just_accepted(span, max_speed):
    dynamics = Dynamics(ACCELERATION, RX24F.speed_unit, max_speed)
    shortest = shortest_sweep(span, dynamics)

    def check(duration):
        check_nod(Nod(-span / 2, span / 2, duration, 1, 0), -0.8, 0.8, dynamics)

    check(shortest * 1.0001)
    with pytest.raises(ParameterError):
        check(shortest * 0.9999)
