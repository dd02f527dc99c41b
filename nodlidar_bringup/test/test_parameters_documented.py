"""Every node's parameters: declared == in its YAML file, with a comment each == in its README."""

from dataclasses import fields
from itertools import pairwise
from pathlib import Path
import re

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.parameters import check, limits_of
from nodlidar_driver.config import DriverConfig
from nodlidar_servo.config import ServoConfig
import pytest
import yaml

WORKSPACE = Path(__file__).parents[2]
NODES = {'assembler': AssemblerConfig, 'driver': DriverConfig, 'servo': ServoConfig}

pytestmark = pytest.mark.parametrize('node', NODES)


def plain(value):
    return list(value) if isinstance(value, tuple) else value


def declared(node):
    return {field.name: plain(field.default) for field in fields(NODES[node])}


def yaml_text(node):
    return (WORKSPACE / f'nodlidar_{node}' / 'config' / f'{node}.yaml').read_text()


def readme_rows(node):
    """Return the defaults of a README's table; a row may have several parameters."""
    text = (WORKSPACE / f'nodlidar_{node}' / 'README.md').read_text()
    table = text[text.index('| parameter | default |') :].split('\n\n')[0]
    rows = {}
    for line in table.splitlines()[2:]:
        names, defaults = (cell.strip() for cell in line.split('|')[1:3])
        names = re.findall(r'`(\w+)`', names)
        defaults = defaults.replace('`', '')
        values = [defaults] if len(names) == 1 else defaults.split(', ')
        rows |= dict(zip(names, map(yaml.safe_load, values), strict=True))
    return rows


def test_the_yaml_file_has_every_parameter_with_its_default(node):
    assert yaml.safe_load(yaml_text(node)) == {'/**': {'ros__parameters': declared(node)}}


def test_every_key_of_the_yaml_file_has_a_comment(node):
    lines = [line.strip() for line in yaml_text(node).split('ros__parameters:\n')[1].splitlines()]
    for before, line in pairwise(['', *filter(None, lines)]):
        assert line.startswith('#') or before.startswith('#'), line


def test_the_readme_has_every_parameter_with_its_default(node):
    assert readme_rows(node) == declared(node)


def test_every_parameter_has_a_description_and_its_default_is_allowed(node):
    assert all(limits_of(field).description for field in fields(NODES[node]))
    check(NODES[node]())
