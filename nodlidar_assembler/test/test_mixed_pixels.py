import math

from hypothesis import given, strategies
from hypothesis.extra.numpy import arrays
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.mixed_pixels import find_mixed_pixels, MixedPixelConfig
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.scan_assembler import ScanAssembler
import numpy as np
import pytest

STEP = math.tau / 1024.0
CONFIG = MixedPixelConfig(mixed_pixel_angle=0.2, mixed_pixel_step=0.05)


def geometry(beams, step=STEP, range_max=5.6):
    return ScanGeometry(beams, 0.0, step, 0.1 / 1024, 0.02, range_max)


def found(ranges, config=CONFIG, step=STEP):
    ranges = np.asarray(ranges, dtype=np.float32)
    return find_mixed_pixels(ranges, geometry(len(ranges), step), config).tolist()


def angle_at_the_farther(one, other):
    """Return the angle between the beam of the farther point and its way to the nearer one."""
    far, near = max(one, other), min(one, other)
    behind = np.array([far - near * math.cos(STEP), near * math.sin(STEP)])
    return math.atan2(behind[1], behind[0])


def off_line(ranges, i, side):
    """Return how far beam i is off the line of the two on one side (-1, 1), in steps from there.

    It is infinite without two such beams, or if the beam is not behind them.
    """
    if not 0 <= i + 2 * side < len(ranges) or ranges[i] <= ranges[i + side]:
        return math.inf
    r, near, next_one = (float(ranges[i + side * k]) for k in range(3))
    one, other = (
        np.array([length * math.cos(k * STEP), length * math.sin(k * STEP)])
        for k, length in ((1, near), (2, next_one))
    )
    crossing = one + (other - one) * one[1] / (one[1] - other[1])
    return abs(r - crossing[0]) / (r - near)


def test_the_ramp_behind_an_edge_is_removed_and_the_edge_kept():
    assert found([1.0, 1.0, 1.6, 2.4, 3.0, 3.0]) == [False, False, True, True, True, False]
    assert found([3.0, 3.0, 2.4, 1.6, 1.0, 1.0]) == [False, True, True, True, False, False]


def test_a_single_point_between_two_surfaces_is_removed():
    assert found([2.0, 2.0, 2.5, 3.0, 3.0]) == [False, False, True, True, False]


@pytest.mark.parametrize('broken', [math.nan, math.inf, -math.inf, 0.0, 9.0])
def test_a_beam_without_a_measurement_is_no_neighbour(broken):
    assert found([1.0, broken, 3.0, 3.0]) == [False] * 4
    assert found([broken] * 3) == [False] * 3


@given(strategies.floats(0.5, 2.9), strategies.floats(1.02, 1.9))  # within the 5.6 m of the scan
def test_the_angle_decides(near, ratio):
    far = float(np.float32(near * ratio))
    near = float(np.float32(near))
    angle = angle_at_the_farther(near, far)
    config = MixedPixelConfig(mixed_pixel_angle=0.2, mixed_pixel_step=0.0)
    if abs(angle - 0.2) > 1e-4:
        assert found([near, far], config) == [False, angle < 0.2]
        assert found([far, near], config, -STEP) == [angle < 0.2, False]


@given(strategies.floats(0.3, 1.0), strategies.floats(-1.2, 1.2))
def test_a_wall_is_kept_up_to_the_angle(distance, azimuth):
    """Beam and wall enclose the angle asin(distance / range)."""
    turn = azimuth + np.arange(12) * STEP
    ranges = distance / np.cos(turn)
    flattest = math.asin(distance / ranges.max())
    if ranges.max() < 5.5 and flattest > 0.21:
        assert not any(found(ranges))


@pytest.mark.parametrize('end', [slice(None), slice(None, None, -1)])
def test_a_wall_is_kept_at_any_angle(end):
    """From 1.2 m beside it on, to 16 m ahead, with 10 mm of noise: 0.075 rad in the end."""
    azimuth = np.arange(math.asin(1.2 / 16.0), math.pi / 2.0, math.tau / 1440)
    ranges = 1.2 / np.sin(azimuth) + np.random.default_rng(0).normal(0.0, 0.01, len(azimuth))
    scan = geometry(len(ranges), math.tau / 1440, 30.0)
    lost = find_mixed_pixels(ranges[end].astype(np.float32), scan, CONFIG)
    assert np.mean(lost[ranges[end] > 6.0]) < 0.1


def test_what_is_behind_the_end_of_such_a_wall_is_removed():
    azimuth = np.arange(0.3, 0.1, -STEP)
    wall = 0.5 / np.sin(azimuth)  # to 5 m, at 0.1 rad
    scan = geometry(len(wall) + 2, STEP, 30.0)
    assert not find_mixed_pixels(np.float32([*wall, np.nan, np.nan]), scan, CONFIG).any()
    lost = find_mixed_pixels(np.float32([*wall, 7.0, 9.0]), scan, CONFIG)
    assert lost.tolist() == [False] * len(wall) + [True, True]


@given(arrays(np.float32, 40, elements=strategies.floats(0.125, 5.0, width=32)))
def test_it_equals_a_loop_over_pairs(ranges):
    expected = [False] * 40
    for i in range(39):
        near, far = sorted([i, i + 1], key=lambda k: (ranges[k], k))
        n, f = float(ranges[near]), float(ranges[far])
        margin = 1e-5
        steep = angle_at_the_farther(n, f) - 0.2
        step = f - n - 0.05
        if abs(steep) < margin or abs(step) < margin:
            return
        if steep < 0.0 and step > 0.0:
            off = max(off_line(ranges, each, near - far) for each in (far, near))
            if abs(off - 0.25) < margin:
                return
            expected[far] |= off > 0.25
    assert found(ranges) == expected


def test_small_steps_are_noise():
    """At 0.2 m, neighbours are 1.2 mm apart, and by the angle, 15 mm of noise would count."""
    ranges = [0.2, 0.215, 0.2, 0.21]
    assert not any(found(ranges))
    assert any(found(ranges, MixedPixelConfig(mixed_pixel_angle=0.2, mixed_pixel_step=0.0)))


@pytest.mark.parametrize(('angle', 'points'), [(0.0, 6), (0.2, 3)])
def test_the_pipeline_removes_and_counts_them(angle, points):
    ranges = np.array([1.0, 1.0, 1.6, 2.4, 3.0, 3.0], dtype=np.float32)
    pipeline = Pipeline(PipelineConfig(mixed_pixel_angle=angle))
    scan = Scan(10**9, geometry(6), ranges)
    samples = np.array([0, 10**9 - 1, 10**9 + 10**7, 2 * 10**9]), np.zeros(4)
    assembled = pipeline.add_scan(scan, *samples)
    assert len(assembled.clouds[0].data) == points
    assert pipeline.mixed_pixels == 6 - points
    np.testing.assert_array_equal(assembled.scan.ranges, ranges)


def test_what_is_removed_is_counted_among_the_remarks():
    assembler = ScanAssembler(AssemblerConfig(mixed_pixel_angle=0.2))
    assert not assembler.remarks
    ranges = np.array([1.0, 1.0, 1.6, 2.4, 3.0, 3.0], dtype=np.float32)
    assembler.add_joint_sample(0, 0.0)
    assembler.add_scan(Scan(10**6, geometry(6), ranges), 0)
    assembler.add_joint_sample(10**7, 0.0)
    (outcome,) = assembler.ready(10**7)
    assert len(outcome.assembled.placed.indices) == 3
    assert assembler.remarks == {'points removed as mixed pixels': 3}


def test_infinity_is_no_measurement_also_where_it_is_the_longest_range():
    endless = ScanGeometry(3, 0.0, STEP, 0.1 / 1024, 0.02, math.inf)
    assert not find_mixed_pixels(np.float32([1.0, math.inf, 1.0]), endless, CONFIG).any()
