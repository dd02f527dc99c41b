from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of, parameter
import pytest


@dataclass(frozen=True, slots=True)
class Config:
    rate: float = parameter(62.0, 'Rate', unit='Hz', minimum=1.0, maximum=100.0)
    count: int = parameter(3, 'Count', minimum=1)
    offset: float = parameter(0.0, 'Offset', unit='s', maximum=0.1)
    gain: float = parameter(1.0, 'Gain')
    place: tuple[float, ...] = parameter((0.0, 1.0), 'Place', unit='m')
    mode: str = parameter('slerp', 'Mode', choices=('slerp', 'ends'))
    enabled: bool = parameter(True, 'Enabled')
    tilt: tuple[float, ...] = parameter((0.0, 0.0), 'Tilt', unit='rad', minimum=-3.2, maximum=3.2)

    def check_together(self):
        if self.enabled and self.count > self.rate:
            raise ParameterError('count', f'at most rate = {self.rate}', self.count)


@pytest.mark.parametrize(
    'values',
    [{}, {'rate': 3.0}, {'rate': 100}, {'mode': 'ends'}, {'enabled': False, 'count': 1000}],
)
def test_values_within_limits_pass(values):
    check(Config(**values))


@pytest.mark.parametrize(
    ('key', 'value', 'limit'),
    [
        ('rate', 0.99, 'between 1.0 and 100.0 Hz'),
        ('rate', 100.1, 'between 1.0 and 100.0 Hz'),
        ('rate', float('nan'), 'finite'),
        ('offset', float('-inf'), 'finite'),
        ('place', (0.0, float('nan')), 'finite'),
        ('tilt', (0.0, 50.0), 'between -3.2 and 3.2 rad'),
        ('count', 0, 'at least 1'),
        ('offset', 0.2, 'at most 0.1 s'),
        ('gain', float('inf'), 'finite'),
        ('mode', 'spline', 'one of slerp, ends'),
        ('count', 63, 'at most rate = 62.0'),
    ],
)
def test_the_error_names_key_limit_and_value(key, value, limit):
    with pytest.raises(ParameterError) as caught:
        check(Config(**{key: value}))
    assert (caught.value.key, caught.value.limit) == (key, limit)
    assert str(caught.value) == f"'{key}' must be {limit}, but is {value!r}"


def test_fields_carry_their_description():
    limits = limits_of(Config.__dataclass_fields__['rate'])
    assert (limits.description, limits.unit, limits.live) == ('Rate', 'Hz', False)
