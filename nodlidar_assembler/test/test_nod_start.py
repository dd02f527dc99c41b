"""The first nod against the model's pattern."""

from dataclasses import replace
import math

from nodlidar_assembler.geometry import ScanGeometry
from nodlidar_assembler.nod_start import first_nod
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

STEP = 2 * math.pi / 1024
URG = ScanGeometry(682, (44 - 384) * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
STAMP_NS = 1_700_000_000_000_000_000


def test_the_reference_sensor_nods_at_pi_rad_per_second():
    nod = first_nod(URG, STAMP_NS, 1024, -0.6136, 0.6136, 4000)
    assert nod.sweep_duration == pytest.approx(0.390625)
    assert nod.speed == pytest.approx(math.pi, rel=1e-4)


def test_beams_follow_the_model_s_pattern_with_half_a_sample_of_phase():
    n_s, span = 4001, 1.2272
    nod = first_nod(URG, STAMP_NS, 1024, -span / 2, span / 2, n_s)
    n = np.arange(20 * 1024)
    times_ns = STAMP_NS + np.rint(n * 0.1 / 1024 * 1e9).astype(np.int64)
    tri = n_s - np.abs((n + 0.5) % (2 * n_s) - n_s)
    np.testing.assert_allclose(nod.pitch(times_ns), -span / 2 + span / n_s * tri, atol=1e-8)


def test_limits_that_do_not_ascend_are_refused():
    with pytest.raises(ParameterError, match='pitch_max'):
        first_nod(URG, STAMP_NS, 1024, 0.5, 0.5, 4001)


def test_a_lidar_that_is_mounted_upside_down_nods_the_same():
    overhead = replace(URG, angle_min=-URG.angle_min, angle_increment=-STEP)
    nods = [first_nod(urg, STAMP_NS, 1024, -0.5, 0.5, 4001) for urg in (URG, overhead)]
    assert nods[0] == nods[1]


def test_a_scan_that_does_not_tell_its_beam_period_makes_no_nod():
    with pytest.raises(ParameterError, match='sweep_duration'):
        first_nod(replace(URG, time_increment=0.0), STAMP_NS, 1024, -0.5, 0.5, 4001)
