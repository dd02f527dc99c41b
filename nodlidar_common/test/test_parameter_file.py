"""Parameter files as ROS reads them: which sections count, and which values are refused."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameter_file import file_values
from nodlidar_common.parameters import parameter
from nodlidar_common.yaml_file import YamlError
import pytest


@dataclass(frozen=True, slots=True)
class Config:
    rate: float = parameter(1.0, 'A number')
    count: int = parameter(1, 'A whole number')
    mode: str = parameter('off', 'A word')
    live: bool = parameter(False, 'Whether')
    place: tuple[float, float] = parameter((0.0, 0.0), 'Two numbers')


@pytest.fixture
def values(tmp_path):
    def of(text, node='assembler'):
        path = tmp_path / 'parameters.yaml'
        path.write_text(text)
        return file_values([path], node, Config)

    return of


def section(name, *lines):
    return '\n'.join([f'{name}:', '  ros__parameters:', *(f'    {line}' for line in lines), ''])


def test_values_are_those_of_the_types_of_the_parameters(values):
    text = section(
        'assembler', 'rate: 2.5', 'count: 3', "mode: 'on'", 'live: true', 'place: [1.0, 2.0]'
    )
    assert values(text) == {
        'rate': 2.5, 'count': 3, 'mode': 'on', 'live': True, 'place': (1.0, 2.0),
    }  # fmt: skip


@pytest.mark.parametrize('name', ['/**', 'assembler', '/assembler', '/robot/assembler'])
def test_sections_for_the_node_count_in_any_namespace(values, name):
    assert values(section(name, 'count: 3')) == {'count': 3}


def test_a_section_may_be_in_those_of_its_namespaces(values):
    inner = 'front: {assembler: {ros__parameters: {count: 3}}, servo: {ros__parameters: {}}}'
    assert values(f'robot: {{{inner}}}') == {'count': 3}


def test_other_nodes_and_other_parameters_are_passed_over(values):
    assert values(section('driver', 'count: 3')) == {}
    assert values(section('/**', 'use_sim_time: true', 'count: 3')) == {'count': 3}


def test_a_misspelt_parameter_is_told(values, capsys):
    assert values(section('/**', 'cuont: 3', 'rat: 2.0', 'servo_id: 1')) == {}
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("there is no parameter 'rat': is 'rate' meant?")


def test_a_later_section_overrides_an_earlier_one(values):
    own, general = section('/robot/assembler', 'count: 3'), section('/**', 'count: 2', 'rate: 2.0')
    assert values(general + own) == {'count': 3, 'rate': 2.0}
    assert values(own + general) == {'count': 2, 'rate': 2.0}


@pytest.mark.parametrize('node', ['/right/assembler', '/assembler', '/left/robot/assembler'])
def test_the_section_of_a_node_in_another_namespace_does_not_count(values, node):
    assert values(section('/left/assembler', 'count: 3'), node) == {}
    assert values(section('/left/assembler', 'count: 3'), '/left/assembler') == {'count': 3}


@pytest.mark.parametrize(
    ('line', 'message'),
    [
        ('rate: 2', "'rate' must be of type float, but is 2"),
        ('count: 2.0', "'count' must be of type int, but is 2.0"),
        ('mode: off', "'mode' must be of type str, in quotes, but is False"),
        ('live: 1', "'live' must be of type bool, but is 1"),
        ('place: 1.0', "'place' must be a list of floats, but is 1.0"),
        ('place: [1.0, 2]', r"'place' must be a list of floats, but is \[1.0, 2\]"),
    ],
)
def test_a_value_of_another_type_is_refused_as_ros_does(values, line, message):
    with pytest.raises(ParameterError, match=message):
        values(section('/**', line))


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('a: [', r"parameters.yaml', line 1: expected the node content"),
        ('just words', 'is not a parameter file'),
        ('', 'is not a parameter file'),
        ('rate: 2.0', "'rate' must be in a section such as '/[*][*]', under 'ros__parameters'"),
        ('/**: {ros__parameters: {}}\nother:', "'other' must be in a section"),
        ('assembler: {rate: 2.0}', "'rate' must be in a section such as"),
        ('a: {ros__parameters: 1}', "'a' must be a section with 'ros__parameters' alone"),
        ('a: {ros__parameters: {}, b: {}}', "'a' must be a section with 'ros__parameters' alone"),
        ('a: {b-c: {ros__parameters: {}}}', "'a/b-c' must be a node's name or a pattern"),
    ],
)
def test_what_is_no_parameter_file_is_refused(values, text, message):
    with pytest.raises(ParameterError, match=message):
        values(text)


def test_a_file_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(YamlError, match=r"none.yaml': No such file or directory"):
        file_values([tmp_path / 'none.yaml'], 'assembler', Config)
