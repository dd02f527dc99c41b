from dataclasses import dataclass, replace

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.ros.node_parameters import declare
import pytest
import rclpy
from rclpy.parameter import Parameter


@dataclass(frozen=True, slots=True)
class Config:
    port: str = parameter('/dev/ttyACM0', 'Device file')
    rate: float = parameter(62.0, 'Rate', unit='Hz', minimum=1.0, maximum=100.0, live=True)
    count: int = parameter(3, 'Count', minimum=1, live=True)
    mode: str = parameter('slerp', 'Mode', choices=('slerp', 'ends'), live=True)
    limits: tuple[float, ...] = parameter((-0.5, 0.5), 'Limits', unit='rad', live=True)

    def check_together(self):
        if self.count > self.rate:
            raise ParameterError('count', f'at most rate = {self.rate}', self.count)


@pytest.fixture
def node():
    """Return a function that makes a node with the parameters that a user set."""
    rclpy.init()
    nodes = []

    def make(**overrides):
        given = [Parameter(name, value=value) for name, value in overrides.items()]
        nodes.append(rclpy.create_node('configured', parameter_overrides=given))
        return nodes[-1]

    yield make
    for each in nodes:
        each.destroy_node()
    rclpy.shutdown()


def test_defaults_and_what_the_user_set(node):
    assert declare(node(), Config) == Config()
    configured = declare(node(rate=10.0, port='/dev/lidar', limits=[0.0, 1.0]), Config)
    assert configured == Config(rate=10.0, port='/dev/lidar', limits=(0.0, 1.0))


def test_a_misspelt_name_is_told(node, capfd):
    assert declare(node(limit=[0.0, 1.0]), Config) == Config()
    assert "there is no parameter 'limit': is 'limits' meant?" in capfd.readouterr().err


def test_a_parameter_of_another_node_is_passed_over(node, capfd):
    declare(node(joint_name='tilt', use_sim_time=False), Config)
    assert 'there is no parameter' not in capfd.readouterr().err


def test_what_the_user_did_not_set_is_as_in_other_defaults(node):
    others = Config(rate=50.0, count=7, limits=(0.0, 0.1))
    assert declare(node(), Config, defaults=others) == others
    assert declare(node(count=9), Config, defaults=others) == replace(others, count=9)


def test_other_defaults_are_checked_together_with_what_the_user_set(node):
    with pytest.raises(ParameterError, match="'count' must be at most rate"):
        declare(node(count=60), Config, defaults=Config(rate=50.0))


def test_parameters_describe_themselves(node):
    made = node()
    declare(made, Config)
    rate, port, mode = made.describe_parameters(['rate', 'port', 'mode'])
    assert (rate.description, rate.read_only) == ('Rate [Hz]', False)
    [interval] = rate.floating_point_range
    assert (interval.from_value, interval.to_value) == (1.0, 100.0)
    assert (port.description, port.read_only) == ('Device file', True)
    assert mode.additional_constraints == 'one of slerp, ends'
    [at_least_one] = made.describe_parameter('count').integer_range
    assert at_least_one.from_value == 1


@pytest.mark.parametrize(
    ('key', 'value', 'message'),
    [
        ('rate', 'fast', "'rate' must be of type float, but is 'fast'"),
        ('rate', 62, "'rate' must be of type float, but is 62"),
        ('count', 1.5, "'count' must be of type int, but is 1.5"),
        ('rate', 0.5, "'rate' must be between 1.0 and 100.0 Hz, but is 0.5"),
        ('rate', float('nan'), "'rate' must be between 1.0 and 100.0 Hz, but is nan"),
        ('limits', 'wide', "'limits' must be a list of floats, but is 'wide'"),
        ('limits', [0, 1], "'limits' must be a list of floats, but is [0, 1]"),
        ('limits', [0.0, float('inf')], "'limits' must be finite, but is (0.0, inf)"),
        ('count', 0, "'count' must be at least 1, but is 0"),
        ('mode', 'spline', "'mode' must be one of slerp, ends, but is 'spline'"),
        ('count', 63, "'count' must be at most rate = 62.0, but is 63"),
    ],
)
def test_a_wrong_start_is_named(node, key, value, message):
    with pytest.raises(ParameterError) as caught:
        declare(node(**{key: value}), Config)
    assert str(caught.value) == message


def test_an_empty_list_is_checked_like_any_other():
    """Of `-p limits:=[]`, rclpy makes a parameter without a value."""
    rclpy.init(args=['--ros-args', '-p', 'limits:=[]'])
    try:
        assert declare(rclpy.create_node('configured'), Config).limits == ()
    finally:
        rclpy.shutdown()


def test_an_empty_list_in_place_of_a_number_is_refused():
    rclpy.init(args=['--ros-args', '-p', 'rate:=[]'])
    try:
        with pytest.raises(ParameterError, match=r"'rate' must be of type float, but is \[\]"):
            declare(rclpy.create_node('configured'), Config)
    finally:
        rclpy.shutdown()


def test_live_changes_are_handed_on(node):
    made, seen = node(), []
    declare(made, Config, seen.append)
    made.set_parameters([Parameter('rate', value=50.0)])
    made.set_parameters([Parameter('limits', value=[0.0, 0.25])])
    made.set_parameters([Parameter('limits', value=[0.0, 0.25])])  # nothing changes
    assert seen == [Config(rate=50.0), Config(rate=50.0, limits=(0.0, 0.25))]


@pytest.mark.parametrize(
    ('key', 'value', 'reason'),
    [
        ('port', '/dev/other', 'read-only'),
        ('rate', 'fast', 'type'),
        ('mode', 'spline', "'mode' must be one of slerp, ends, but is 'spline'"),
        ('count', 63, "'count' must be at most rate = 62.0, but is 63"),
        ('rate', 1000.0, 'rate'),
        ('limits', [float('nan'), 0.0], "'limits' must be finite, but is (nan, 0.0)"),
    ],
)
def test_wrong_changes_are_refused(node, key, value, reason):
    made, seen = node(), []
    declare(made, Config, seen.append)
    before = made.get_parameter(key).value
    [result] = made.set_parameters([Parameter(key, value=value)])
    assert not result.successful
    assert reason in result.reason
    assert made.get_parameter(key).value == before
    assert seen == []


def test_parameters_changed_together_are_checked_together(node):
    made, seen = node(), []
    declare(made, Config, seen.append)
    change = [Parameter('rate', value=2.0), Parameter('count', value=2)]
    assert made.set_parameters_atomically(change).successful
    assert seen == [Config(rate=2.0, count=2)]
    [alone] = made.set_parameters([Parameter('count', value=3)])
    assert "'count' must be at most rate = 2.0" in alone.reason


def test_other_parameters_of_the_node_are_left_alone(node):
    made, seen = node(), []
    declare(made, Config, seen.append)
    made.declare_parameter('other', 1)
    [result] = made.set_parameters([Parameter('other', value=2)])
    assert result.successful
    assert seen == []
