from dataclasses import dataclass, replace
import time

from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nodlidar_common.dynamics import cruising_speed, Dynamics
from nodlidar_common.nod import Nod
from nodlidar_common.tracking import NodTracker
from nodlidar_servo.joint_trajectory.waypoints import held, leg, Planner, stop, Waypoint
from nodlidar_sim.devices.trajectory_controller import Trajectory, TrajectoryController
import numpy as np
import pytest

S = 1_000_000_000
T0 = 1_763_900_000 * S
DYNAMICS = Dynamics(50.0, 0.0, 6.0)
LIMITS = (-2.0, 2.0)
NOD = Nod(-0.4, 0.5, 0.74, 7547, T0)


@dataclass(frozen=True)
class Sample:
    stamp_ns: int
    pitch: float
    velocity: float


def holding(pitch):
    """Return the controller of a joint at rest."""
    controller = TrajectoryController()
    controller.update(T0, pitch, 0.0)
    return controller


def sent(controller, plan, now_ns, measured=None):
    """Send a plan to a joint, which is where it is commanded unless measured; none is refused."""
    begin = plan[0].time_ns
    times_ns = np.array([each.time_ns - begin for each in plan])
    states = np.array([[each.pitch, each.velocity, np.nan] for each in plan])
    controller.accept(Trajectory(begin, times_ns, states), now_ns)
    controller.update(now_ns, *(controller.at(now_ns) if measured is None else measured))


def test_a_leg_is_a_trapezoid_of_speed_in_closed_form():
    points = leg(NOD, 2, 50.0)
    times = [(point.time_ns - T0) / S - 2 * 0.74 for point in points]
    # v * (T - v / a) = span: the lower root
    v = (0.74 - (0.74**2 - 4 * 0.9 / 50.0) ** 0.5) * 50.0 / 2.0
    assert [p.velocity for p in points] == pytest.approx([0.0, v, v, 0.0])
    assert times == pytest.approx([0.0, v / 50.0, 0.74 - v / 50.0, 0.74], abs=1e-6)
    assert [p.pitch for p in points] == pytest.approx(
        [-0.4, -0.4 + v**2 / 100, 0.5 - v**2 / 100, 0.5]
    )
    down = leg(NOD, 3, 50.0)
    assert [p.pitch for p in down] == pytest.approx([0.1 - p.pitch for p in points])


def test_splines_through_the_waypoints_are_in_phase_and_need_no_more_than_the_joint_has():
    controller = holding(-0.4)
    sent(
        controller,
        [p for n in range(4) for p in leg(NOD, n, 50.0)[:-1]] + [leg(NOD, 3, 50.0)[-1]],
        T0,
    )
    times = T0 + np.arange(0, int(2.9 * S), 500_000)
    pitch, velocity = np.array([controller.at(t) for t in times]).T
    assert np.abs(np.diff(velocity) / 5e-4).max() < 50.0 * 1.01
    assert pitch.min() >= -0.4 - 1e-9
    assert pitch.max() <= 0.5 + 1e-9
    for n in range(4):  # half-way at half-time
        assert controller.at(T0 + round((n + 0.5) * 0.74 * S))[0] == pytest.approx(0.05)


def test_the_shortest_leg_is_acceleration_and_braking_alone():
    nod = replace(NOD, sweep_duration=2.0 * (0.9 / 50.0) ** 0.5 * (1.0 + 1e-12))
    assert len({p.time_ns for p in leg(nod, 0, 50.0)}) == len(leg(nod, 0, 50.0)) >= 3


def test_a_moving_joint_stops_by_its_acceleration():
    rest = stop(Sample(T0, 0.2, -3.0), T0 + 10_000_000, 50.0, LIMITS)
    assert rest.time_ns == T0 + 10_000_000 + round(3.0 / 50.0 * S)
    assert rest.pitch == pytest.approx(0.2 - 0.03 - 9.0 / 100.0)
    assert rest.velocity == 0.0


@pytest.mark.parametrize(
    ('pitch', 'velocity', 'expected'),
    [(0.3, 3.0, 0.8), (-0.3, -3.0, -0.8), (0.9, 3.0, 0.8), (0.9, -6.0, -0.8), (0.0, 0.5, 0.3025)],
)
def test_a_joint_stops_within_the_mount_however_old_the_sample(pitch, velocity, expected):
    sample, now_ns = Sample(T0, pitch, velocity), T0 + 600_000_000
    assert stop(sample, now_ns, 50.0, (-0.8, 0.8)).pitch == pytest.approx(expected)
    plan = Planner(DYNAMICS, (-0.8, 0.8)).plan(NOD, sample, now_ns)
    assert plan[0].pitch == pytest.approx(expected)


@pytest.mark.parametrize('pitch', [2.0, -3.14, 0.83])
def test_a_joint_outside_of_the_mount_comes_back_slowly_and_joins_the_nod(pitch):
    controller, planner = holding(pitch), Planner(DYNAMICS, (-0.8, 0.8))
    seen = []
    for step in range(3000):
        now = T0 + step * 5_000_000
        seen.append(controller.at(now))
        if step % 20 == 0:
            sent(controller, planner.plan(NOD, Sample(now, *seen[-1]), now), now)
    outside = [each for each in seen if abs(each[0]) > 0.801]
    assert max(abs(velocity) for _, velocity in outside) <= 1.01
    assert max(abs(p) for p, _ in outside) <= abs(pitch) + 1e-6
    assert len(outside) < 1000
    assert planner.follows(NOD, Sample(now, *seen[-1]))


@settings(max_examples=60)
@given(
    lie=st.floats(-100.0, 100.0),
    velocity=st.floats(-7.2, 7.2),
    after_ms=st.integers(0, 2000),
    outlasts_ms=st.integers(1, 6000),
)
def test_a_joint_never_leaves_the_mount_whatever_is_said_of_it(
    lie, velocity, after_ms, outlasts_ms
):
    """From an instant on, its states are those of another joint, and are believed."""
    controller, planner = holding(-0.4), Planner(DYNAMICS, (-0.8, 0.8))
    for step in range(0, after_ms + outlasts_ms + 1000, 5):
        now = T0 + step * 1_000_000
        truth = controller.at(now)
        assert -0.81 <= truth[0] <= 0.81
        is_lie = after_ms <= step < after_ms + outlasts_ms
        if step % 100 == 0:
            plan = planner.plan(NOD, Sample(now, *((lie, velocity) if is_lie else truth)), now)
            assert all(-0.8 <= each.pitch <= 0.8 for each in plan)
            sent(controller, plan, now)


@pytest.mark.parametrize('velocity', [0.0, 0.05, -3.0])
def test_a_stop_is_accepted_also_if_it_arrives_after_the_joint_is_at_rest(velocity):
    rest, controller = stop(Sample(T0, 0.2, velocity), T0, 50.0, LIMITS), holding(0.2)
    sent(controller, held(rest), T0 + 300_000_000)
    for later in (400_000_000, 2 * S):
        assert controller.at(T0 + later) == (pytest.approx(rest.pitch), pytest.approx(0.0))


@pytest.mark.parametrize('sweep_duration', [0.4, 0.74, 8.0])
@pytest.mark.parametrize('pitch', [-0.7, -0.4, 0.1, 0.5, 0.79])
def test_the_first_reversal_that_a_cubic_reaches_within_the_limits_is_chosen(
    pitch, sweep_duration
):
    nod = replace(NOD, sweep_duration=sweep_duration, reference_time_ns=T0 - 12_345)
    rest, goal, *_ = Planner(DYNAMICS, LIMITS).plan(nod, Sample(T0, pitch, 0.0), T0)

    def is_reached(
        number,
    ):  # the speed of a cubic is highest half-way, its acceleration at the ends
        duration = (nod.reversal_time_ns(number) - rest.time_ns) / S
        way = abs((NOD.pitch_min, NOD.pitch_max)[number % 2] - pitch)
        fastest = min(2.0 * nod.speed, DYNAMICS.max_speed)
        return duration > 0 and 1.5 * way / duration <= fastest and 6 * way / duration**2 <= 50.0

    first = next(number for number in range(100) if is_reached(number))
    assert goal.time_ns == nod.reversal_time_ns(first)
    assert goal.pitch == (NOD.pitch_min, NOD.pitch_max)[first % 2]


@pytest.mark.parametrize('offset_ms', [0, 30, 70])
def test_slow_sweeps_up_and_fast_ones_down_are_followed_though_commanded_one_by_one(offset_ms):
    """As with nod_mode interlaced: each is known from 0.12 s before it begins."""
    up, down, known = 700, 400, 120  # ms
    planner, controller = Planner(DYNAMICS, LIMITS), holding(-0.4)

    def sweep(ms):
        """Return whether a sweep goes up, as a nod of its own, and when it begins [ms]."""
        within = ms % (up + down)
        rises = within < up
        begin = ms - within + (0 if rises else up)
        duration, reference = (up, begin) if rises else (down, begin - down)
        nod = Nod(-0.4, 0.5, duration / 1e3, 4001, T0 + reference * 1_000_000)
        return rises, nod, begin

    for ms in range(0, 20_000, 5):
        now = T0 + ms * 1_000_000
        rises, nod, begin = sweep(ms)
        pitch, velocity = controller.at(now)
        if ms > 3000:  # on the nod
            way = 0.9 * (ms - begin) / 1e3 / nod.sweep_duration
            assert pitch == pytest.approx(-0.4 + way if rises else 0.5 - way, abs=0.06)
        if ms % 100 == offset_ms:
            _, other, start = sweep(ms + known)
            after = (other, T0 + start * 1_000_000) if start > ms else None
            sent(controller, planner.plan(nod, Sample(now, pitch, velocity), now, after), now)


def test_a_nod_that_begins_elsewhere_than_at_a_near_limit_is_not_planned_ahead():
    plan = Planner(DYNAMICS, LIMITS).plan(NOD, Sample(T0, -0.4, 0.0), T0)
    for change, start in (
        ({'sweep_duration': 0.4}, 0.3),
        ({'pitch_max': 0.2}, 0.74),
        ({'reference_time_ns': T0 + S // 10}, 0.74),
        ({'sweep_duration': 0.37}, 7.4),  # far ahead
    ):
        after = replace(NOD, **change), T0 + round(start * S)
        assert Planner(DYNAMICS, LIMITS).plan(NOD, Sample(T0, -0.4, 0.0), T0, after) == plan


def test_a_nod_that_begins_before_the_last_braking_is_accepted():
    slow = replace(NOD, sweep_duration=20.0)  # brakes in 0.9 ms
    other = replace(NOD, reference_time_ns=T0 + 40 * S - 1_500_000)
    controller, now = holding(-0.39), T0 + 40 * S - S // 5
    sample = Sample(now, -0.4 + 0.2 * 0.9 / 20.0, -0.9 / 20.0)
    planner = Planner(DYNAMICS, LIMITS)
    planner.plan(slow, sample, now - S // 10)
    plan = planner.plan(slow, sample, now, (other, T0 + 40 * S))
    sent(controller, plan, now)
    assert other.reversal_time_ns(1) in [point.time_ns for point in plan]


def test_a_nod_with_countless_reversals_is_planned_at_once():
    nod = Nod(0.0, 1e-9, 1e-6, 1, T0)
    began = time.process_time()
    rest, goal, *_ = Planner(Dynamics(1e6, 0.0, 6.0), LIMITS).plan(nod, Sample(T0, 1.0, 0.0), T0)
    assert goal.time_ns - rest.time_ns == pytest.approx(1.5 / 0.002 * S, rel=1e-6)
    assert time.process_time() - began < 5.0


@settings(max_examples=20)
@given(
    pitch=st.floats(-1.5, 1.5),
    velocity=st.floats(-4.0, 4.0),
    phase=st.floats(0.0, 1.48),
    span=st.floats(0.05, 1.4),
    speed=st.floats(0.15, 2.5),  # slower ones may take longer than the 40 s below
)
def test_any_joint_comes_to_the_nod_within_its_speed_and_acceleration(
    pitch, velocity, phase, span, speed
):
    nod = Nod(-span / 2, span / 2, span / speed, 4001, T0 - round(phase * S))
    assume(cruising_speed(nod, DYNAMICS.acceleration) <= DYNAMICS.max_speed)
    planner, controller = Planner(DYNAMICS, LIMITS), TrajectoryController()
    moves = Waypoint(T0 - 1, pitch, velocity), Waypoint(T0 + S, pitch + velocity, velocity)
    sent(controller, [*moves, Waypoint(T0 + 2 * S, 0.0, 0.0)], T0 - 1, (pitch, velocity))
    before, seen = velocity, []
    arrived = None
    for step in range(20_000):
        now = T0 + step * 2_000_000
        p, v = controller.at(now)
        seen.append(p)
        assert abs(v) <= max(abs(velocity), 2.0 * nod.speed, 1e-6) * 1.35 + 0.01
        assert abs(v - before) / 2e-3 <= 50.0 * 1.6 + 1.0
        before = v
        if step % 50 == 0:
            sent(controller, planner.plan(nod, Sample(now, p, v), now), now)
            if arrived is None and planner.follows(nod, Sample(now, p, v)):
                arrived = step
        if arrived is not None and step > arrived + 2_000:
            break
    assert arrived is not None
    stopping = pitch + velocity * abs(velocity) / 100.0
    low, high = sorted((pitch, stopping))
    assert min(seen) >= min(low, -span / 2) - 0.01
    assert max(seen) <= max(high, span / 2) + 0.01


@settings(max_examples=30)
@given(early=st.floats(-0.5, 0.5), changes_at=st.integers(0, 60))
def test_stamps_that_are_wrong_make_no_joint_faster_and_none_leave_the_nod(early, changes_at):
    """The nod also changes once, wherever the joint is."""
    planner, controller = Planner(DYNAMICS, LIMITS), holding(0.3)
    nod, states = NOD, [(0.3, 0.0)]
    for step in range(600):
        now = T0 + step * 10_000_000
        if step == 300 + changes_at:
            nod = replace(NOD, pitch_min=-0.2, sweep_duration=0.61)
        if step % 10 == 0:
            p, v = states[-1]
            sent(controller, planner.plan(nod, Sample(now - round(early * S), p, v), now), now)
        states.append(controller.at(now))
        assert abs(states[-1][1]) <= 1.35 * 2.0 * nod.speed
        assert -0.4 - 1e-3 <= states[-1][0] <= 0.5 + 1e-3
    pitches, velocities = np.array(states).T
    assert np.abs(np.diff(pitches)).max() <= 0.01 * np.abs(velocities).max() + 6e-3  # no jumps
    assert pitches[300:].min() < -0.19  # it goes on
    assert pitches[300:].max() > 0.49


@pytest.mark.parametrize('early', [-0.45, -0.2, -0.12, -0.08, 0.08, 0.12, 0.2, 0.45])
@pytest.mark.parametrize('age_ms', [5, 100])
def test_no_joint_jumps_to_where_wrong_stamps_have_it(early, age_ms):
    """Joint states are as old as a slow publisher's; plans come after the time they are for."""
    planner, controller = Planner(DYNAMICS, (-0.8, 0.8)), holding(-0.4)
    states, plan = [], []
    for ms in range(6000):
        now = T0 + ms * 1_000_000
        states.append(controller.at(now))
        if ms % 97 == 0:  # at ever other phases
            then = max(ms - age_ms, 0)
            stamp_ns = T0 + then * 1_000_000 - (round(early * S) if ms > 1500 else 0)
            plan = planner.plan(NOD, Sample(stamp_ns, *states[then]), now)
        if ms % 97 == 3:
            sent(controller, plan, now)
    pitches = np.array(states)[:, 0]
    assert np.abs(np.diff(pitches)).max() / 1e-3 <= 1.35 * 2.0 * NOD.speed
    assert pitches.min() >= -0.42
    assert pitches.max() <= 0.52


@pytest.mark.parametrize('stops_ms', [0, 250, 700])
@pytest.mark.parametrize('pause_ms', [100, 450, 900, 1500])
def test_a_joint_that_was_held_starts_again_without_a_jump_though_stamps_are_early(
    stops_ms, pause_ms
):
    planner, controller = Planner(DYNAMICS, LIMITS), holding(-0.4)
    before = 2220 + stops_ms
    pitches = []
    for ms in range(before + pause_ms + 500):
        now = T0 + ms * 1_000_000
        p, v = controller.at(now)
        pitches.append(p)
        sample = Sample(now - (450_000_000 if ms >= before else 0), p, v)
        if ms == before:
            sent(controller, planner.hold(sample, now), now)
        elif ms % 100 == 0 and not before <= ms < before + pause_ms:
            sent(controller, planner.plan(NOD, sample, now), now)
    speed = np.abs(np.diff(pitches)) / 1e-3
    assert speed.max() <= 1.35 * 2.0 * NOD.speed
    assert speed[before + 99 : before + pause_ms - 1].max(initial=0.0) < 1e-6


@pytest.mark.parametrize('held_ms', [100, 1000, 5000])
def test_a_joint_that_was_held_where_the_nod_passes_does_not_begin_at_its_speed(held_ms):
    planner, middle = Planner(DYNAMICS, LIMITS), T0 + round(10.5 * 0.74 * S)
    for ms in range(held_ms, 0, -100):
        now = middle - ms * 1_000_000
        planner.hold(Sample(now, 0.05, 0.0), now)
    plan = planner.plan(NOD, Sample(middle, 0.05, 0.0), middle)
    assert (plan[0].pitch, plan[0].velocity) == pytest.approx((0.05, 0.0))


@pytest.mark.parametrize('lag', [0.0, 0.04, 0.08, 0.12])
def test_the_phase_of_a_joint_that_lags_is_kept(lag):
    """The joint is a low-pass filter of second order behind the controller; the nod changes."""
    planner, controller = Planner(DYNAMICS, LIMITS), holding(0.3)
    tracker = NodTracker(NOD, DYNAMICS)
    p, v, rng = 0.3, 0.0, np.random.default_rng(1)
    filtered = [p, p]
    pitches = []
    for step in range(40_000):
        now = T0 + step * S // 1000
        goal = controller.at(now)[0]
        if lag:
            for stage in range(2):
                filtered[stage] += ((goal, filtered[0])[stage] - filtered[stage]) * 2e-3 / lag
        else:
            filtered[1] = goal
        p, v = filtered[1], (filtered[1] - p) * 1000.0
        pitches.append(p)
        if step % 10 == 0:
            tracker.measure_phase(Sample(now, p + rng.normal(0.0, 1e-3), v))
        if step == 20_000:
            tracker.nod = replace(NOD, pitch_min=-0.2, sweep_duration=0.61)
        if step % 100 == 0:
            plan = planner.plan(tracker.led, Sample(now, p, v), now)
            sent(controller, plan, now + 3_000_000, (p, v))
    assert abs(tracker.phase.error) < 2e-3
    last = np.array(pitches[-5000:])
    times = T0 + (np.arange(35_000, 40_000)) * (S // 1000)
    phase = np.mod(tracker.nod.sweeps(times), 1.0)
    middle = np.abs(phase - 0.5) < 0.2
    assert np.abs((last - tracker.nod.pitch(times))[middle]).max() < 0.03
    assert last.min() >= -0.2 - 1e-3
    assert last.max() <= 0.5 + 1e-3
