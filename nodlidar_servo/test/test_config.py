from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_servo.device.config import ServoConfig
import pytest


@pytest.mark.parametrize(
    ('key', 'values'),
    [
        ('model', {'model': 'XL-320'}),
        ('servo_id', {'servo_id': 254}),
        ('pitch_upper_limit', {'pitch_lower_limit': 0.5, 'pitch_upper_limit': 0.5}),
        ('pitch_lower_limit', {'pitch_lower_limit': -3.0}),
        ('pitch_upper_limit', {'zero_tick': 1000}),
        ('feedback_rate', {'feedback_rate': 0.0}),
        ('position_gain', {'model': 'MX-28', 'position_gain': 900}),
    ],
)
def test_wrong_values_are_named(key, values):
    with pytest.raises(ParameterError) as caught:
        check(ServoConfig(**values))
    assert caught.value.key == key


def test_an_unknown_model_is_told_the_known_ones():
    with pytest.raises(ParameterError, match='RX-24F, RX-28, RX-64, AX-12A'):
        check(ServoConfig(model='XL-320'))
