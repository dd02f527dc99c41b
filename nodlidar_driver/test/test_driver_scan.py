import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import DeviceError, ParameterError
from nodlidar_driver.identity import Capabilities
from nodlidar_driver.scan import ranges, scan_window, ScanWindow
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
    window = scan_window(-2.0862, 2.0924, 1, 0)
    assert (window.first_step, window.last_step, window.count) == (44, 725, 682)
    assert window.angle_min == pytest.approx(math.radians(-119.53), abs=1e-4)
    assert window.angle_max == pytest.approx(math.radians(119.88), abs=1e-4)
    assert window.angle_increment == pytest.approx(0.00613592, abs=1e-8)


@settings(deadline=None)
@given(st.integers(44, 725), st.integers(1, 682), st.integers(1, 99), st.floats(-0.49, 0.49))
def test_angles_belong_to_the_least_beams_of_whole_clusters(first, width, cluster, rounding):
    last = min(first + width - 1, 725)
    angle_min, angle_max = ((step - 384 + rounding) * INCREMENT for step in (first, last))
    groups = np.split(np.arange(first, last + 1), range(cluster, 999, cluster))
    whole = [group for group in groups if len(group) == cluster]
    if not whole:
        with pytest.raises(ParameterError, match='angle_max'):
            scan_window(angle_min, angle_max, cluster, 0)
        return
    window = scan_window(angle_min, angle_max, cluster, 0)
    angles = window.angle_min + window.angle_increment * np.arange(window.count)
    np.testing.assert_allclose(angles, [(g.mean() - 384) * INCREMENT for g in whole], atol=1e-12)
    assert window.angle_max == pytest.approx(angles[-1])
    assert window.first_beam == whole[0].mean()
    assert (window.first_step, window.last_step) == (first, whole[-1][-1])


def test_a_window_narrower_than_a_cluster_is_refused_with_its_limit():
    with pytest.raises(ParameterError, match=r"'angle_max' must be at least 5 steps \(0.0307 rad"):
        scan_window(0.0, 3 * INCREMENT, 5, 0)


def test_only_what_the_lidar_measures_can_be_had():
    ScanWindow(44, 725, 1, 0).check_measured_by(lidar())
    with pytest.raises(DeviceError, match='steps 50 to 725, but 44 to 725'):
        ScanWindow(44, 725, 1, 0).check_measured_by(lidar(first_step=50))
    with pytest.raises(DeviceError, match='has 1440 and 540'):
        ScanWindow(44, 725, 1, 0).check_measured_by(
            lidar(steps_per_revolution=1440, front_step=540)
        )


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
