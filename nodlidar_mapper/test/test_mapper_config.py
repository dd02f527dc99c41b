"""Parameters that contradict each other."""

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_mapper.config import MapperConfig
import pytest


@pytest.mark.parametrize(
    ('given', 'message'),
    [
        ({'cloud_topics': ()}, "'cloud_topics' must be at least one, all different, but is ()"),
        ({'cloud_topics': ('',)}, 'at least one'),
        ({'cloud_topics': ('a', 'b', 'a')}, 'all different'),
        ({'odom_frame': ''}, "'odom_frame' must be a frame other than map_frame = 'map'"),
        ({'odom_frame': 'map'}, "'odom_frame' must be a frame other than map_frame = 'map'"),
        ({'base_frame': 'odom'}, "'base_frame' must be a frame other than odom_frame = 'odom'"),
        ({'base_frame': 'map'}, "'base_frame' must be a frame other than map_frame = 'map'"),
        ({'band_bottom': 2.0}, "'band_top' must be above band_bottom = 2.0 m, but is 1.8"),
    ],
)
def test_a_contradiction_is_named(given, message):
    with pytest.raises(ParameterError) as caught:
        check(MapperConfig(**given))
    assert message in str(caught.value)


def test_the_defaults_and_several_sensors_are_allowed():
    check(MapperConfig())
    check(MapperConfig(cloud_topics=('left/points', 'right/points')))
