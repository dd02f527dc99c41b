"""Every parameter at its limits: allowed, and beyond refused by name (docs/extremes.md)."""

from dataclasses import fields
import math

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of
from nodlidar_driver.config import ScipConfig
from nodlidar_mapper.config import MapperConfig
from nodlidar_planner.plan_scan.options import Request
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_viewer.config import ViewerConfig
import pytest

CONFIGURATIONS = (
    AssemblerConfig,
    ScipConfig,
    MapperConfig,
    Request,
    ServoConfig,
    TrajectoryConfig,
    ViewerConfig,
)
EDGES = [
    pytest.param(of, field.name, edge, outward, id=f'{of.__name__}-{field.name}-{edge}')
    for of in CONFIGURATIONS
    for field in fields(of)
    for edge, outward in (
        (limits_of(field).minimum, -math.inf),
        (limits_of(field).maximum, math.inf),
    )
    if edge is not None
]


def typed(of, key, value):
    """Return a value in the type of a parameter: each number of a list is this one."""
    default = of.__dataclass_fields__[key].default
    return (value,) * len(default) if isinstance(default, tuple) else value


def refusal(of, key, value):
    """Return the error of a configuration with one value, None if it is allowed."""
    try:
        check(of(**{key: typed(of, key, value)}))
    except ParameterError as error:
        return error
    return None


@pytest.mark.parametrize(('of', 'key', 'edge', 'outward'), EDGES)
def test_a_limit_itself_is_allowed_unless_another_parameter_is_against_it(of, key, edge, outward):
    error = refusal(of, key, edge)
    own = limits_of(of.__dataclass_fields__[key])
    assert error is None or error.limit != own.in_words()


@pytest.mark.parametrize(('of', 'key', 'edge', 'outward'), EDGES)
def test_just_beyond_a_limit_is_refused_by_name(of, key, edge, outward):
    beyond = math.nextafter(edge, outward)
    if isinstance(edge, int):
        beyond = edge + int(math.copysign(1, outward))
    error = refusal(of, key, beyond)
    own = limits_of(of.__dataclass_fields__[key])
    assert (error.key, error.limit, error.value) == (key, own.in_words(), typed(of, key, beyond))


@pytest.mark.parametrize(('of', 'key', 'edge', 'outward'), EDGES)
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused_by_name(of, key, edge, outward, value):
    error = refusal(of, key, value)
    assert (error.key, error.limit) == (key, 'finite')
