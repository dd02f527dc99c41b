"""Every node's parameters: declared == in its YAML file, with a comment each == in its README."""

from dataclasses import fields
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
import re

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_bringup.argument_values import tf_rate
from nodlidar_common.parameters import check, limits_of
from nodlidar_servo.device.config import ServoConfig
import pytest
import yaml

WORKSPACE = Path(__file__).parents[2]
SPEC = spec_from_file_location('parameter_docs', WORKSPACE / 'tools' / 'parameter_docs.py')
parameter_docs = module_from_spec(SPEC)
SPEC.loader.exec_module(parameter_docs)
NODES, LEFT_TO_LAUNCH = parameter_docs.NODES, parameter_docs.LEFT_TO_LAUNCH
plain = parameter_docs.plain

of_every_node = pytest.mark.parametrize('node', NODES)


def fields_of(node):
    return [field for config_class in NODES[node] for field in fields(config_class)]


def declared(node):
    return {field.name: plain(field.default) for field in fields_of(node)}


def yaml_text(node):
    return (parameter_docs.folder_of(node) / 'config' / f'{node}.yaml').read_text()


def given_too(node):
    """Return the text of a YAML file with the keys that are left to the launch not in comments."""
    keys = '|'.join(LEFT_TO_LAUNCH[node]) or '(?!)'
    return re.sub(rf'^( +)# ((?:{keys}): .+)$', r'\1\2', yaml_text(node), flags=re.MULTILINE)


@of_every_node
def test_the_yaml_file_has_every_parameter_with_its_default(node):
    assert yaml.safe_load(given_too(node)) == {'/**': {'ros__parameters': declared(node)}}


@of_every_node
def test_the_yaml_file_sets_nothing_that_is_left_to_the_launch(node):
    own = {k: v for k, v in declared(node).items() if k not in LEFT_TO_LAUNCH[node]}
    assert yaml.safe_load(yaml_text(node)) == {'/**': {'ros__parameters': own}}


@of_every_node
def test_every_key_of_the_yaml_file_has_a_comment(node):
    lines = [line.strip() for line in given_too(node).split('ros__parameters:\n')[1].splitlines()]
    for before, line in pairwise(['', *filter(None, lines)]):
        assert line.startswith('#') or before.startswith('#'), line


@pytest.mark.parametrize('path', parameter_docs.documents(), ids=lambda path: path.name)
def test_what_is_documented_is_what_the_code_says(path):
    assert path.read_text() == parameter_docs.documents()[path], 'stale: run `make docs`'


@of_every_node
def test_the_readme_has_every_parameter(node):
    text = (parameter_docs.folder_of(node) / 'README.md').read_text()
    assert [name for name in declared(node) if f'\n| `{name}` |' not in text] == []


@of_every_node
def test_every_parameter_has_a_description_and_its_default_is_allowed(node):
    assert all(limits_of(field).description for field in fields_of(node))
    for config_class in NODES[node]:
        check(config_class())


def launched(profile):
    """Return what the launch argument gives to the nodes."""
    path = WORKSPACE / 'nodlidar_bringup' / 'config' / 'profiles' / f'{profile}.yaml'
    return yaml.safe_load(path.read_text())['/**']['ros__parameters']


@pytest.mark.parametrize('profile', PROFILES)
def test_a_profile_is_allowed_and_launched_by_its_name(profile):
    check(PROFILES[profile])
    given = launched(profile)
    assert given['profile'] == profile
    of_state_publisher = 'publish_frequency'
    assert set(given) == LEFT_TO_LAUNCH['servo'] | {'profile', of_state_publisher}
    check(ServoConfig(feedback_rate=given['feedback_rate']))
    assert tf_rate(str(given[of_state_publisher])) == given[of_state_publisher]


def test_the_default_profile_is_that_of_the_default_parameters():
    default = ProfileConfig().profile
    assert PROFILES[default] == AssemblerConfig()
    assert launched(default)['feedback_rate'] == ServoConfig().feedback_rate
