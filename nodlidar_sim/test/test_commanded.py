import math

from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.commanded import CommandedBase
from nodlidar_sim.world.route import Leg, Plan
import numpy as np
import pytest

S = 1_000_000_000
START = (1.0, 2.0, 0.3)


def test_a_base_without_commands_stands():
    base = CommandedBase(START, 0, 0.5)
    np.testing.assert_array_equal(base.poses(np.array([0, 5 * S])), [START])


def test_a_command_holds_until_its_timeout():
    base = CommandedBase((0.0, 0.0, 0.0), 0, 0.5)
    base.drive((1.0, 0.0), 2 * S)
    found = base.poses(np.array([S, 2 * S, 2 * S + S // 4, 3 * S, 9 * S]))
    np.testing.assert_allclose(found[:, 0], [0.0, 0.0, 0.25, 0.5, 0.5])


def test_commands_are_driven_one_after_the_other():
    """At 10 Hz for 20 s, each replacing the one before, as a route of the same legs."""
    commands = [(0.3 + 0.2 * math.sin(k), math.cos(0.3 * k)) for k in range(200)]
    route = Plan(legs=tuple(Leg(0.1, command) for command in commands)).route(START, 0)
    base = CommandedBase(START, 0, 0.5)
    for k, command in enumerate(commands):
        base.drive(command, k * S // 10)
        recent = np.maximum(k * S // 10 + np.array([-S + 1, -S // 3, 0, S // 11]), 0)
        np.testing.assert_allclose(base.poses(recent), route.poses(recent), atol=1e-9)


def test_what_was_driven_long_ago_is_forgotten():
    base = CommandedBase(START, 0, 0.5)
    for k in range(1000):
        base.drive((0.1, 0.0), k * S // 20)
    assert len(base._route.starts_ns) < 30


@pytest.mark.parametrize('velocity', [(math.nan, 0.0), (0.0, math.inf)])
def test_a_command_that_is_not_finite_is_refused(velocity):
    base = CommandedBase(START, 0, 0.5)
    with pytest.raises(ParameterError, match='velocity'):
        base.drive(velocity, S)
    np.testing.assert_array_equal(base.poses(np.array([2 * S])), [START])
