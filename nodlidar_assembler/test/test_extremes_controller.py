"""The choice of the nod while it runs, at every limit of its parameters (docs/extremes.md)."""

from dataclasses import fields
import math

from assembling import assembled_of
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.adaptive_limits import AdaptiveLimits
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
OF_THE_NOD = (
    'pitch_min', 'pitch_max', 'samples_per_sweep', 'steps_per_revolution', 'band_bottom',
    'band_top', 'sensor_height', 'limits_rate', 'max_nod_speed',
    'max_nod_acceleration', 'timing_error', 'object_size', 'object_distance', 'coverage_window',
)  # fmt: skip
EDGES = [
    (field.name, edge)
    for field in fields(AssemblerConfig)
    for edge in (limits_of(field).minimum, limits_of(field).maximum)
    if field.name in OF_THE_NOD
]
AGAINST = {
    ('pitch_min', 1.6): 'pitch_max',
    ('pitch_max', -1.6): 'pitch_max',
    ('band_bottom', 100.0): 'band_top',
    ('band_top', -100.0): 'band_top',
    ('object_size', 10.0): 'object_size',
}


def nods(config, ranges, revolutions=8):
    """Return the nods that are commanded as limits follow what a lidar sees; shape, coverage."""
    check(config)
    n_l = config.steps_per_revolution
    beams = max(1, 682 * n_l // 1024)
    geometry = ScanGeometry(beams, -2.0, math.tau / n_l, 0.1 / n_l, 0.02, math.inf)
    at = Beams(geometry, REFERENCE_LASER_POSE)
    controller, adaptive = NodController(config), AdaptiveLimits(config)
    monitor = CoverageMonitor(config) if config.coverage_window > 0.0 else None
    found = []
    for revolution in range(revolutions):
        now_ns = START_NS + revolution * S // 10
        controller.add_scan(geometry, now_ns)
        found.append(controller.command[0])
        pitch = found[-1].pitch(now_ns + at.offset_ns)
        scan = Scan(now_ns, geometry, np.full(beams, ranges, np.float32))
        assembled = assembled_of(scan, at, pitch)
        if monitor is not None:
            monitor.add(assembled)
        adaptive.add(assembled, None)
        controller.add_beams(now_ns, at, pitch, now_ns + S // 10)
        controller.change(adaptive.shape(), now_ns + S // 10)
    return found, adaptive.shape(), monitor


def assert_right(found, shape, monitor, config):
    for nod in found:
        assert config.pitch_min <= nod.pitch_min < nod.pitch_max <= config.pitch_max
        assert 0.0 < nod.sweep_duration < math.inf
        assert 1 <= nod.samples_per_sweep < 2**32
    assert math.gcd(shape.samples_per_sweep, config.steps_per_revolution) == 1
    speed = (shape.pitch_max - shape.pitch_min) / (
        shape.samples_per_sweep * 0.1 / config.steps_per_revolution
    )
    assert speed <= config.max_nod_speed * (1 + 1e-9)
    if monitor is not None:
        covered = monitor.covered()
        assert 0.0 <= covered.seen <= 1.0
        assert 0.0 <= covered.least_repeats <= covered.repeats + 1e-12 <= 1.0
        assert math.isfinite(covered.hole)


@pytest.mark.parametrize(('key', 'edge'), [edge for edge in EDGES if edge not in AGAINST])
@pytest.mark.parametrize('nod_mode', ['coprime', 'feedback'])
def test_at_every_limit_a_nod_within_the_limits_is_commanded(key, edge, nod_mode):
    config = AssemblerConfig(**{key: edge}, nod_mode=nod_mode)
    assert_right(*nods(config, 2.0), config)


@pytest.mark.parametrize('ranges', [0.0, 1e-40, 1e-3, 1e6, 1e38, math.inf, math.nan])
def test_whatever_the_ranges_a_nod_within_the_limits_is_commanded(ranges):
    config = AssemblerConfig()
    assert_right(*nods(config, ranges), config)


@pytest.mark.parametrize('nod_mode', ['coprime', 'feedback'])
@pytest.mark.parametrize('low', [-1.0, 0.0, 0.999_998])
def test_a_nod_of_a_microradian_is_commanded(low, nod_mode):
    config = AssemblerConfig(pitch_min=low, pitch_max=low + 1.01e-6, nod_mode=nod_mode)
    assert_right(*nods(config, 2.0), config)


@pytest.mark.parametrize(('key', 'edge'), AGAINST)
def test_limits_against_another_parameter_are_refused_by_name(key, edge):
    with pytest.raises(ParameterError) as caught:
        check(AssemblerConfig(**{key: edge}))
    assert caught.value.key == AGAINST[key, edge]


@pytest.mark.parametrize('span', [0.0, 5e-324, 1e-12, 0.99e-6])
def test_less_span_than_a_microradian_is_refused(span):
    limit = r"'pitch_max' must be at least 1e-06 rad above pitch_min = 0\.0 rad"
    with pytest.raises(ParameterError, match=limit):
        check(AssemblerConfig(pitch_min=0.0, pitch_max=span))
