import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.route import Leg, Plan
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
speeds = st.floats(-1.0, 1.0)
legs = st.lists(st.builds(Leg, st.floats(0.1, 3.0), st.tuples(speeds, speeds)), max_size=4)


def poses(plan, start, seconds):
    times_ns = START_NS + np.rint(np.asarray(seconds) * S).astype(np.int64)
    return np.broadcast_to(plan.route(start, START_NS).poses(times_ns), (len(times_ns), 3))


def test_who_stands_has_one_pose():
    route = Plan().route((1.0, 2.0, 0.5), START_NS)
    assert route.stands
    np.testing.assert_array_equal(route.poses(np.array([0, S, 2 * S])), [[1.0, 2.0, 0.5]])


def test_a_constant_velocity_leads_straight_along_the_heading():
    found = poses(Plan((0.5, 0.0)), (1.0, 2.0, math.pi / 2), [0.0, 2.0])
    expected = [[1.0, 2.0, math.pi / 2], [1.0, 3.0, math.pi / 2]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_constant_twist_is_a_circle_with_its_centre_to_the_left():
    """0.5 m/s at 0.25 rad/s: radius 2 m, around (0, 2)."""
    seconds = np.linspace(0.0, 60.0, 200)
    angle = 0.25 * seconds
    expected = np.stack([2.0 * np.sin(angle), 2.0 - 2.0 * np.cos(angle), angle], axis=1)
    found = poses(Plan((0.5, 0.25)), (0.0, 0.0, 0.0), seconds)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_before_its_start_a_route_stands():
    found = poses(Plan((0.5, 0.25)), (3.0, 2.0, 1.0), [-1.0, -1e-9])
    np.testing.assert_array_equal(found, [[3.0, 2.0, 1.0]] * 2)


def test_after_its_legs_a_route_goes_on_with_its_velocity():
    plan = Plan((0.1, 0.0), (Leg(2.0, (1.0, 0.0)), Leg(1.0, (0.0, math.pi / 2))))
    found = poses(plan, (0.0, 0.0, 0.0), [1.0, 2.5, 3.0, 13.0])
    expected = [[1, 0, 0], [2, 0, math.pi / 4], [2, 0, math.pi / 2], [2, 1, math.pi / 2]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


@given(legs, st.tuples(speeds, speeds), st.floats(-3.0, 3.0))
def test_a_route_is_the_integral_of_its_twists(parts, velocity, yaw):
    """Midpoint rule at 1 ms; a step in which the twist changes errs by up to 2 mm."""
    plan = Plan(velocity, tuple(parts))
    seconds = np.arange(0.0, 10.0, 1e-3)
    ends = np.cumsum([0.0] + [leg.duration for leg in parts])[1:]
    twists = np.array([leg.velocity for leg in parts] + [velocity])
    speed, rate = twists[np.searchsorted(ends, seconds + 5e-4)].T
    heading = yaw + np.cumsum(rate) * 1e-3 - rate * 5e-4
    x = 0.3 + np.cumsum(speed * np.cos(heading)) * 1e-3
    y = -0.2 + np.cumsum(speed * np.sin(heading)) * 1e-3
    found = poses(plan, (0.3, -0.2, yaw), seconds)
    expected = np.stack([x, y, heading + rate * 5e-4], axis=1)[:-1]
    np.testing.assert_allclose(found[1:], expected, atol=2e-2)


def figure_of_eight(radius, rate):
    circle = 2.0 * math.pi / rate
    return (Leg(circle, (radius * rate, rate)), Leg(circle, (radius * rate, -rate)))


def test_a_figure_of_eight_closes_on_itself():
    """Two circles that touch at the start, left then right, lap after lap."""
    lap = 4.0 * math.pi / 0.5
    seconds = np.linspace(0.0, lap, 101)
    plan = Plan(legs=figure_of_eight(0.6, 0.5), repeat=True)
    found = poses(plan, (1.0, 2.0, 0.0), seconds)
    angle = 0.5 * seconds
    side = np.where(seconds < lap / 2.0, 1.0, -1.0)
    x, y = 1.0 + 0.6 * np.sin(angle), 2.0 + side * 0.6 * (1.0 - np.cos(angle))
    np.testing.assert_allclose(found[:, :2], np.stack([x, y], axis=1), atol=1e-8)
    np.testing.assert_allclose(found[-1], [1.0, 2.0, 0.0], atol=1e-8)
    later = poses(plan, (1.0, 2.0, 0.0), seconds + 1000 * lap)
    np.testing.assert_allclose(later, found, atol=1e-5)  # the legs are rounded to ns


@given(st.lists(st.builds(Leg, st.floats(0.1, 3.0), st.tuples(speeds, speeds)), min_size=1))
def test_laps_that_do_not_close_go_on_from_where_they_ended(parts):
    parts = tuple(parts[:3])
    lap = sum(leg.duration_ns for leg in parts) / S
    seconds = np.linspace(0.0, 4.0 * lap * 0.999, 50)
    start = (0.5, -1.0, 2.0)
    repeated = poses(Plan(legs=parts, repeat=True), start, seconds)
    np.testing.assert_allclose(repeated, poses(Plan(legs=parts * 4), start, seconds), atol=1e-7)


@pytest.mark.parametrize('parts', [(Leg(4.0, (0.5, math.pi / 2)),), (Leg(4.0, (0.5, math.pi)),)])
def test_laps_of_whole_turns_keep_counting_them(parts):
    found = poses(Plan(legs=parts, repeat=True), (0.0, 0.0, 0.0), [10.0, 16.0])
    expected = poses(Plan(parts[0].velocity), (0.0, 0.0, 0.0), [10.0, 16.0])
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_a_time_has_one_pose_to_the_nanosecond():
    """At 1 m/s a pose moves on by 1 nm in 1 ns, 54 years after the epoch."""
    route = Plan((1.0, 0.0), (Leg(1.0, (1.0, 0.0)),)).route((0.0, 0.0, 0.0), START_NS)
    x = route.poses(START_NS + S + np.array([-1, 0, 1]))[:, 0]
    np.testing.assert_allclose(x, [1.0 - 1e-9, 1.0, 1.0 + 1e-9], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ('make', 'key'),
    [
        (lambda: Leg(0.0, (1.0, 0.0)), 'duration'),
        (lambda: Leg(-1.0, (1.0, 0.0)), 'duration'),
        (lambda: Plan(repeat=True), 'legs'),
        (lambda: Plan((1.0, 0.0), (Leg(1.0, (1.0, 0.0)),), repeat=True), 'velocity'),
    ],
)
def test_a_plan_that_cannot_be_driven_is_refused(make, key):
    with pytest.raises(ParameterError) as error:
        make()
    assert error.value.key == key


def test_whether_a_plan_drives():
    assert not Plan(legs=(Leg(1.0, (0.0, 0.0)),)).drives
    assert Plan(legs=(Leg(1.0, (0.0, 0.1)),)).drives
    assert Plan((0.1, 0.0)).drives
