"""By the rules of the joint_trajectory_controller, with polynomials in closed form."""

from nodlidar_sim.devices.trajectory_controller import (
    Trajectory,
    TrajectoryController,
    TrajectoryError,
)
import numpy as np
import pytest

S, MS = 1_000_000_000, 1_000_000
NOW = 1_700_000_000 * S
SHARES = np.array([0.0, 0.1, 0.3, 0.5, 0.75, 1.0])


def trajectory(*points, start_ns=NOW):
    """Return a trajectory of points: time [s], position, and what else is given."""
    states = [[*values, np.nan, np.nan][:3] for _, *values in points]
    times_ns = np.array([round(time * S) for time, *_ in points], dtype=np.int64)
    return Trajectory(start_ns, times_ns, np.reshape(states, (-1, 3)).astype(np.float64))


def following(new, now_ns=NOW, position=0.0, velocity=0.0):
    controller = TrajectoryController()
    controller.accept(new, now_ns)
    controller.update(now_ns, position, velocity)
    return controller


def positions(controller, times):
    return [controller.at(NOW + round(time * S))[0] for time in times]


def test_a_joint_is_held_where_it_is_until_the_first_trajectory():
    controller = TrajectoryController()
    controller.update(NOW, 0.3, 1.0)
    controller.update(NOW + MS, 0.4, 1.0)
    assert [controller.at(NOW + each) for each in (0, MS, 100 * S)] == [(0.3, 0.0)] * 3


@pytest.mark.parametrize(
    ('given', 'shape'),
    [
        ((), lambda s: s),
        ((0.0,), lambda s: 3 * s**2 - 2 * s**3),
        ((0.0, 0.0), lambda s: 10 * s**3 - 15 * s**4 + 6 * s**5),
    ],
    ids=['linear', 'cubic', 'quintic'],
)
def test_the_polynomial_has_the_degree_of_what_is_given(given, shape):
    """From rest to rest: of two points, the cubic and the quintic are known in closed form."""
    controller = following(trajectory((0.0, 0.2, *given), (2.0, 0.6, *given)))
    np.testing.assert_allclose(positions(controller, 2.0 * SHARES), 0.2 + 0.4 * shape(SHARES))


def test_what_one_end_of_a_part_lacks_does_not_count():
    controller = following(trajectory((0.0, 0.0, 0.0), (1.0, 1.0), (2.0, 0.0, 0.0, 0.0)))
    np.testing.assert_allclose(positions(controller, SHARES), SHARES)
    np.testing.assert_allclose(positions(controller, 1.0 + SHARES), 1.0 - SHARES, atol=1e-12)
    assert controller.at(NOW + S // 4)[1] == pytest.approx(1.0)


def test_constant_acceleration_is_a_cubic():
    """At 4 rad/s^2 from rest: 2 t^2, and 4 t."""
    controller = following(trajectory((0.0, 0.0, 0.0), (0.5, 0.5, 2.0), (1.0, 1.0, 0.0)))
    for time in (0.1, 0.2, 0.4):
        assert controller.at(NOW + round(time * S)) == pytest.approx((2 * time**2, 4 * time))


@pytest.mark.parametrize('start_ns', [0, NOW])
def test_up_to_the_first_point_it_goes_from_where_it_was_measured(start_ns):
    """At 1 rad/s from 0.2 rad to 0.7 rad and 0 rad/s in 1 s is a constant acceleration."""
    new = trajectory((1.0, 0.7, 0.0), (2.0, 0.7, 0.0), start_ns=start_ns)
    controller = following(new, position=0.2, velocity=1.0)
    for time in (0.0, 0.4, 1.0):
        expected = 0.2 + time - time**2 / 2.0, 1.0 - time
        assert controller.at(NOW + round(time * S)) == pytest.approx(expected)
    straight = following(trajectory((1.0, 0.7), start_ns=start_ns), position=0.2, velocity=1.0)
    np.testing.assert_allclose(positions(straight, SHARES), 0.2 + 0.5 * SHARES)


def test_points_that_are_past_are_passed_over_wherever_the_joint_is():
    new = trajectory((0.0, 0.0), (1.0, 1.0), (2.0, 0.0), start_ns=NOW - 3 * S // 2)
    controller = following(new, position=0.9, velocity=3.0)
    assert controller.at(NOW) == pytest.approx((0.5, -1.0))
    assert controller.at(NOW + S // 4) == pytest.approx((0.25, -1.0))


def test_the_end_is_held():
    controller = following(trajectory((0.0, 0.0), (1.0, 0.4)))
    assert controller.at(NOW + S) == (pytest.approx(0.4), 0.0)
    assert controller.at(NOW + 1000 * S) == (pytest.approx(0.4), 0.0)
    one = following(trajectory((0.0, 0.4, 0.0), start_ns=NOW), now_ns=NOW)
    assert one.at(NOW + 5 * S) == (pytest.approx(0.4), 0.0)


def test_it_commands_what_the_real_controller_commanded():
    """Numbers that its functions, compiled from ros2_controllers 4.42.1, printed at 100 Hz.

    A cubic whose first point is to come; after 95 ms a quintic that began 200 ms before the first
    cycle; after 195 ms straight lines from now on.
    """
    new = {
        0: trajectory((0.0, 0.3, 1.5), (0.1, 0.5, 0.7), (0.3, 0.2, 0.0), start_ns=NOW + 30 * MS),
        100: trajectory(
            (0.0, -0.4, 0.1, 2.0),
            (0.25, 0.1, -0.6, -3.0),
            (0.45, 0.6, 0.0, 1.0),
            start_ns=NOW - 200 * MS,
        ),
        200: trajectory((0.06, -0.2), (0.09, 0.1), start_ns=0),
    }
    printed = {
        0: (0.109703703704, 10.6111111111),
        10: (0.227629629630, 11.2444444444),
        30: (0.317120000000, 1.9060000000),
        90: (0.455960000000, 2.0740000000),
        100: (0.156491200000, 3.2214000000),
        120: (0.234297600000, 4.4592000000),
        190: (0.543671875000, 2.8734375000),
        200: (0.025000000000, -4.5000000000),
        240: (-0.155000000000, -4.5000000000),
        250: (-0.200000000000, 10.0000000000),
        280: (0.100000000000, 0.0),
        310: (0.100000000000, 0.0),
    }
    controller = TrajectoryController()
    for ms in range(0, 320, 10):
        now_ns = NOW + ms * MS
        if ms in new:
            controller.accept(new[ms], now_ns - 5 * MS if ms else now_ns)
        controller.update(now_ns, 0.05 + ms / 1e4, -0.4 + ms / 1e3)
        if ms in printed:
            assert controller.at(now_ns + 10 * MS) == pytest.approx(printed[ms], abs=1e-9)


def test_a_trajectory_replaces_the_one_that_runs_at_the_next_update_and_not_again():
    controller = following(trajectory((0.0, 0.0), (1.0, 1.0)))
    controller.accept(trajectory((0.5, 0.0), start_ns=NOW + S // 2), NOW + S // 4)
    assert controller.at(NOW + S // 2)[0] == pytest.approx(0.5)
    controller.update(NOW + S // 2, 0.5, 1.0)
    assert controller.at(NOW + 3 * S // 4)[0] == pytest.approx(0.25)
    controller.update(NOW + 3 * S // 4, 0.9, 1.0)
    assert controller.at(NOW + 3 * S // 4)[0] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ('refused', 'reason'),
    [
        (trajectory(), 'it is empty'),
        (trajectory((0.0, 0.0, 0.0), (1.0, 1.0, 1e-6)), 'last point is not zero'),
        (trajectory((0.0, 0.0), (1.0, 1.0), start_ns=NOW - S - 1), 'ends in the past'),
        (trajectory((0.0, 0.0), (1.0, 1.0), (1.0, 0.0)), 'not strictly increasing'),
    ],
)
def test_what_is_refused_changes_nothing(refused, reason):
    controller = following(trajectory((0.0, 0.0), (1.0, 1.0)))
    with pytest.raises(TrajectoryError, match=reason):
        controller.accept(refused, NOW)
    controller.update(NOW + S // 4, 0.0, 0.0)
    assert controller.at(NOW + S // 2)[0] == pytest.approx(0.5)


def test_what_ends_now_is_accepted():
    controller = following(trajectory((0.0, 0.0), (1.0, 0.4), start_ns=NOW - S))
    assert controller.at(NOW) == (pytest.approx(0.4), 0.0)
