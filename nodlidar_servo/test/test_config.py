from dataclasses import fields
from pathlib import Path

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_servo.config import ServoConfig
import pytest
import yaml

PACKAGE = Path(__file__).parent.parent


def test_yaml_has_every_parameter_with_its_default():
    parameters = yaml.safe_load((PACKAGE / 'config' / 'servo.yaml').read_text())
    defaults = {field.name: field.default for field in fields(ServoConfig)}
    assert parameters['/**']['ros__parameters'] == defaults


def test_readme_documents_every_parameter():
    rows = [
        line.split('|')[1].strip()
        for line in (PACKAGE / 'README.md').read_text().split('\n')
        if line.startswith('| `') and line.count('|') == 5
    ]
    assert rows == [f'`{field.name}`' for field in fields(ServoConfig)]


def test_defaults_are_valid():
    check(ServoConfig())


@pytest.mark.parametrize(
    ('key', 'values'),
    [
        ('model', {'model': 'XL430-W250'}),
        ('servo_id', {'servo_id': 254}),
        ('pitch_upper_limit', {'pitch_lower_limit': 0.5, 'pitch_upper_limit': 0.5}),
        ('pitch_lower_limit', {'pitch_lower_limit': -3.0}),
        ('pitch_upper_limit', {'zero_tick': 1000}),
        ('feedback_rate', {'feedback_rate': 0.0}),
    ],
)
def test_wrong_values_are_named(key, values):
    with pytest.raises(ParameterError) as caught:
        check(ServoConfig(**values))
    assert caught.value.key == key


def test_an_unknown_model_is_told_the_known_ones():
    with pytest.raises(ParameterError, match='RX-24F, AX-12A, MX-28'):
        check(ServoConfig(model='XL430-W250'))
