"""The driver's parameters refuse what they must."""

from lidar_rig import URG
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_driver.config import ScipConfig
import pytest


def test_the_default_window_is_the_whole_one():
    assert ScipConfig().window(URG).count == 682


def test_a_timeout_of_two_scans_is_enough():
    check(ScipConfig(skip=9, timeout=2.0))
    check(ScipConfig(skip=2, timeout=0.6))


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'angle_min': -3.2}, "'angle_min' must be between -3.1416 and 3.1416 rad"),
        ({'angle_max': 3.2}, "'angle_max' must be between -3.1416 and 3.1416 rad"),
        ({'angle_min': 1.0, 'angle_max': 0.5}, "'angle_max' must be above angle_min = 1.0"),
        ({'cluster': 0}, "'cluster' must be between 1 and 99"),
        ({'skip': 10}, "'skip' must be between 0 and 9"),
        ({'timeout': 0.1}, "'timeout' must be between 0.3 and 5.0 s"),
        ({'skip': 9}, "'timeout' must be at least 2.0 s, the time of two scans with skip = 9"),
        ({'skip': 2, 'timeout': 0.5}, "'timeout' must be at least 0.6 s"),
    ],
)
def test_what_is_out_of_limits_is_refused(changes, words):
    with pytest.raises(ParameterError) as error:
        check(ScipConfig(**changes))
    assert words in str(error.value)
