"""Ranges, elevations and whole scans at their limits, against closed forms (docs/extremes.md)."""

import math

from assembling import assemble
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

STEP = 2 * math.pi / 1024
START_NS = 1_700_000_000_123_456_789
Z_OFF = 0.080
THETA = (np.arange(682) + 44 - 384) * STEP
FLOAT32 = 2.0**-23
LARGEST = np.finfo(np.float32).max


def geometry(range_min=0.0, range_max=math.inf):
    return ScanGeometry(682, (44 - 384) * STEP, STEP, 0.1 / 1024, range_min, range_max)


def scanned(ranges, phi=0.0, limits=None, poses=None):
    """Return the points of a scan whose beams all have one pitch, and x, y, z (n, 3)."""
    beams = Beams(limits or geometry(), REFERENCE_LASER_POSE)
    ranges = np.broadcast_to(np.asarray(ranges, dtype=np.float32), 682)
    points = assemble(beams, START_NS, ranges, np.full(682, phi), poses=poses)
    return points, points.xyz


@pytest.mark.parametrize('value', [0.0, 1e-45, 1e-40, 1e-3, 1e6, 1e30, LARGEST])
@pytest.mark.parametrize('phi', [0.0, 0.5])
def test_a_range_within_the_limits_is_told_to_a_float32(value, phi):
    r = float(np.float32(value))
    _, xyz = scanned(value, phi)
    expected = np.stack(
        [
            r * np.cos(THETA) * math.cos(phi) - Z_OFF * math.sin(phi),
            r * np.sin(THETA),
            r * np.cos(THETA) * math.sin(phi) + Z_OFF * math.cos(phi),
        ],
        axis=1,
    )
    assert len(xyz) == 682
    np.testing.assert_allclose(xyz, expected, rtol=FLOAT32, atol=1e-8 + 1e-15 * r)


@pytest.mark.parametrize('value', [math.inf, -math.inf, math.nan, -0.001, -1e6])
def test_a_range_that_is_none_is_absent_however_wide_the_limits(value):
    assert len(scanned(value)[0].data) == 0
    mixed = np.ones(682)
    mixed[[0, 300, 681]] = value
    points, xyz = scanned(mixed)
    np.testing.assert_allclose(xyz[:, 1], np.delete(np.sin(THETA), [0, 300, 681]), atol=1e-6)
    assert points.time_ns[0] == START_NS + 97_656


@pytest.mark.parametrize('value', [0.0, 1e-40, 1e-3, 1e6, math.inf, -math.inf, math.nan])
def test_a_whole_scan_out_of_the_sensors_limits_makes_no_cloud(value):
    scan = Scan(START_NS, geometry(0.02, 5.6), np.full(682, value, np.float32))
    around = START_NS + np.array([0, 70_000_000])
    for mode in ('scan', 'sweep'):
        pipeline = Pipeline(PipelineConfig(cloud_mode=mode))
        assert pipeline.add_scan(scan, around, np.zeros(2)).clouds == []


any_ranges = arrays(np.float32, 682, elements=st.floats(width=32), fill=st.floats(width=32))
finite = st.floats(0, float(LARGEST))
limits = st.tuples(finite, finite | st.just(math.inf)).map(sorted)


@given(
    any_ranges, limits, st.floats(-1.6, 1.6), st.booleans(), st.tuples(*[st.floats(-1e6, 1e6)] * 3)
)
def test_whatever_the_ranges_no_point_is_nan_or_infinite(ranges, near_far, phi, moves, position):
    poses = None
    if moves:
        poses = Poses(np.tile(position, (682, 1)), np.tile([0.5, -0.5, 0.5, 0.5], (682, 1)))
    _, xyz = scanned(ranges, phi, geometry(*near_far), poses)
    near, far = near_far
    within = np.isfinite(ranges) & (ranges >= near) & (ranges <= far)
    assert len(xyz) == np.count_nonzero(within)
    assert np.all(np.isfinite(xyz))


@pytest.mark.parametrize('sign', [1, -1])
def test_at_90_degrees_of_elevation_the_scan_plane_is_upright(sign):
    _, xyz = scanned(2.0, sign * math.pi / 2)
    expected = np.stack(
        [np.full(682, -sign * Z_OFF), 2.0 * np.sin(THETA), sign * 2.0 * np.cos(THETA)], axis=1
    )
    np.testing.assert_allclose(xyz, expected, rtol=FLOAT32, atol=1e-8)


@pytest.mark.parametrize('key', ['range_min', 'range_max'])
@pytest.mark.parametrize('value', [math.nan, -math.inf, -0.001])
def test_limits_of_the_range_that_are_none_are_refused(key, value):
    with pytest.raises(ParameterError, match=f"'{key}' must be at least"):
        geometry(**{key: value})


def test_an_infinite_least_range_is_refused():
    with pytest.raises(ParameterError, match="'range_min' must be at least 0 m and finite"):
        geometry(math.inf, math.inf)
