"""Robots far from the origin of odometry: clouds keep millimetres (docs/extremes.md)."""

import math

from assembling import assemble
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, OdometryError, Poses
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.origins import frame_of, origin_near
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
import numpy as np
import pytest

STEP = 2 * math.pi / 1024
URG = ScanGeometry(682, (44 - 384) * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
BEAMS = Beams(URG, REFERENCE_LASER_POSE)
START_NS = 1_700_000_000_000_000_000
RANGES = np.linspace(0.5, 5.0, 682, dtype=np.float32)
PITCH = np.linspace(-0.6, 0.6, 682)
positions = st.tuples(*[st.floats(-1e6, 1e6)] * 3)


def turned(position, yaw):
    """Return as many poses as beams, at a position x, y, z, turned about z."""
    orientation = np.tile([0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)], (682, 1))
    return Poses(np.tile(np.array(position, float), (682, 1)), orientation)


def around_the_robot(yaw):
    """Return where beams end, from a robot turned by a yaw (docs/model.md), shape (n, 3)."""
    theta, r, z_off = (np.arange(682) + 44 - 384) * STEP, RANGES.astype(float), 0.080
    x = r * np.cos(theta) * np.cos(PITCH) - z_off * np.sin(PITCH)
    y = r * np.sin(theta)
    z = r * np.cos(theta) * np.sin(PITCH) + z_off * np.cos(PITCH)
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)


@given(positions, st.floats(-3.0, 3.0))
def test_a_million_metres_out_a_cloud_is_half_a_millimetre_off_at_most(position, yaw):
    points = assemble(BEAMS, START_NS, RANGES, PITCH, poses=turned(position, yaw))
    expected = around_the_robot(yaw) + position
    assert np.max(np.abs(points.xyz - expected)) < 0.49e-3
    assert max(np.max(np.abs(points.data[axis])) for axis in 'xyz') < 8192 + 6


@given(st.tuples(*[st.floats(-8186, 8186)] * 3))
def test_up_to_8192_m_a_cloud_counts_from_the_origin_of_odometry(position):
    points = assemble(BEAMS, START_NS, RANGES, PITCH, poses=turned(position, 0.0))
    assert points.origin == (0, 0, 0)
    assert np.max(np.abs(points.xyz - around_the_robot(0.0) - position)) < 0.25e-3


@pytest.mark.parametrize(
    ('position', 'frame'),
    [
        ((0.0, 0.0, 0.0), 'odom'),
        ((8192.0, -8192.0, 8191.0), 'odom'),
        ((8192.5, 0.0, 0.0), 'odom_16384_0_0'),
        ((1e6, -1e6, 30.0), 'odom_999424_-999424_0'),
        ((0.0, 0.0, -24_577.0), 'odom_0_0_-32768'),
    ],
)
def test_each_origin_has_a_frame_of_its_own(position, frame):
    assert frame_of(origin_near(position), 'odom') == frame


def test_a_sweep_across_two_origins_is_one_cloud_in_the_frame_of_its_first_scan():
    seconds = np.linspace(0.0, 40.0, 401)  # a sweep is closed after 30 s at the latest
    x = 1_007_616.0 - 8.0 + 0.4 * seconds  # 20 s to the middle between two origins
    zero = np.zeros_like(x)
    odometry = Odometry(
        START_NS + np.rint(seconds * 1e9).astype(np.int64),
        Poses(np.stack([x, zero, zero], axis=1), np.tile([0.0, 0.0, 0.0, 1.0], (401, 1))),
    )
    pipeline = Pipeline(PipelineConfig(cloud_mode='sweep'))
    clouds, ends = [], []
    for k in range(390):
        start_ns = START_NS + k * 100_000_000
        around_ns = start_ns + np.array([0, 80_000_000])
        scan = Scan(start_ns, URG, np.full(682, 2.0, np.float32))
        clouds += pipeline.add_scan(scan, around_ns, np.zeros(2), odometry).clouds
        ends.append(x[0] + 0.04 * k + 0.4 * 340 * 0.1 / 1024 + 2.0)  # of the beam straight ahead
    (cloud,) = clouds
    assert cloud.origin == (999_424, 0, 0)
    ahead = cloud.xyz[340::682, 0]
    np.testing.assert_allclose(ahead, ends[: len(ahead)], rtol=0, atol=1e-3)
    assert x[0] + 0.04 * len(ahead) > 1_007_616.0 + 1.0  # the other origin is the nearer by then


def test_interpolated_odometry_is_as_exact_a_million_metres_out():
    start = np.array([1e6, -1e6, 1e6])
    end = start + np.array([0.1, 0.2, -0.3])
    two = Poses(np.stack([start, end]), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    odometry = Odometry(START_NS + np.array([0, 100_000_000]), two)
    found = odometry.at(START_NS + np.array([25_000_000]), OdometryConfig()).position[0]
    np.testing.assert_allclose(found - start, [0.025, 0.05, -0.075], rtol=0, atol=1e-9)


def test_beyond_a_billion_kilometres_odometry_has_no_millimetres_to_keep():
    with pytest.raises(OdometryError, match=r'beyond 1e\+12 m loses millimetres: 1\.1e\+12 m'):
        assemble(BEAMS, START_NS, RANGES, PITCH, poses=turned((0.0, -1.1e12, 0.0), 0.0))
