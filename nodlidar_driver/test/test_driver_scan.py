import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import DeviceError
from nodlidar_driver.scip.identity import Capabilities
from nodlidar_driver.scip.scan_window import ranges, scan_window
import numpy as np
import pytest

INCREMENT = 2.0 * math.pi / 1024


def lidar(**changes):
    values = {
        'model': 'M',
        'range_min_mm': 20,
        'range_max_mm': 5600,
        'steps_per_revolution': 1024,
        'first_step': 44,
        'last_step': 725,
        'front_step': 384,
        'speed': 600,
    }
    return Capabilities(**values | changes)


def test_the_whole_window_has_682_beams():
    window = scan_window(-math.pi, math.pi, 1, 0, lidar())
    assert (window.first_step, window.last_step, window.count) == (44, 725, 682)
    assert window.angle_min == pytest.approx(math.radians(-119.53), abs=1e-4)
    assert window.angle_max == pytest.approx(math.radians(119.88), abs=1e-4)
    assert window.angle_increment == pytest.approx(0.00613592, abs=1e-8)


@given(st.integers(44, 725), st.integers(1, 682), st.integers(1, 99), st.floats(-0.49, 0.49))
def test_angles_belong_to_the_least_beams_of_whole_clusters(first, width, cluster, rounding):
    last = min(first + width - 1, 725)
    angle_min, angle_max = ((step - 384 + rounding) * INCREMENT for step in (first, last))
    groups = np.split(np.arange(first, last + 1), range(cluster, 999, cluster))
    whole = [group for group in groups if len(group) == cluster]
    if not whole:
        with pytest.raises(DeviceError, match='angle_max'):
            scan_window(angle_min, angle_max, cluster, 0, lidar())
        return
    window = scan_window(angle_min, angle_max, cluster, 0, lidar())
    angles = window.angle_min + window.angle_increment * np.arange(window.count)
    np.testing.assert_allclose(angles, [(g.mean() - 384) * INCREMENT for g in whole], atol=1e-12)
    assert window.angle_max == pytest.approx(angles[-1])
    assert window.first_beam == whole[0].mean()
    assert (window.first_step, window.last_step) == (first, whole[-1][-1])


def test_a_window_narrower_than_a_cluster_is_refused_with_its_limits():
    words = r'azimuths from -2.0862 to 2.0923 rad: no 5 steps of 0.0061 rad'
    with pytest.raises(DeviceError, match=words):
        scan_window(0.0, 3 * INCREMENT, 5, 0, lidar())
    with pytest.raises(DeviceError, match='no 1 steps'):
        scan_window(2.2, 2.5, 1, 0, lidar())


def test_steps_that_are_not_measured_are_left_out():
    window = scan_window(-3.0, 1.0, 1, 0, lidar(first_step=50))
    assert (window.first_step, window.last_step) == (50, 384 + round(1.0 / INCREMENT))


def test_a_lidar_of_1440_steps_has_its_own_angles():
    ust = lidar(
        steps_per_revolution=1440, first_step=0, last_step=1080, front_step=540, speed=2400
    )
    window = scan_window(-math.pi, math.pi, 1, 0, ust)
    assert window.count == 1081
    assert window.angle_min == pytest.approx(-0.75 * math.pi)
    assert window.angle_max == pytest.approx(0.75 * math.pi)
    assert window.angle_increment == pytest.approx(math.radians(0.25))


@pytest.mark.parametrize('speed', [299, 6001])
def test_too_slow_and_too_fast_lidars_are_refused(speed):
    with pytest.raises(DeviceError, match=f'300 to 6000 rpm is supported, not of {speed} rpm'):
        scan_window(-1.0, 1.0, 1, 0, lidar(speed=speed))


def test_every_range_code():
    codes = np.arange(6000)
    result = ranges(codes, 30, 5600)
    assert result.dtype == np.float32
    errors = set(range(20)) - {0, 6}
    for code, value in zip(codes, result, strict=True):
        if code in (0, 6) or code > 5600:
            assert value == math.inf
        elif code in errors:
            assert math.isnan(value)
        elif code < 30:
            assert value == -math.inf
        else:
            assert value == pytest.approx(code / 1000.0, rel=1e-6)
