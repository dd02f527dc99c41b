"""The watch over the calibration: a wrong delay is noticed, motion is not taken for one."""

from dataclasses import replace

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.pitch import PitchError
import nodlidar_assembler.plausibility.sweep_agreement as module
from nodlidar_assembler.plausibility.sweep_agreement import SweepAgreement
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np
import pytest

SWEEP = 7547
NOD = Nod(-0.61, 0.61, SWEEP * 0.1 / 1024, SWEEP, 0)


def watched(
    scene, delay=0.0, velocity=(0.0, 0.0), backwards=False, increment=1.0, nod=NOD, duration=13.0
):
    """Return the watch after a duration [s] in a scene, with windows of 4 s.

    The joint states have a delay [s], the ranges are in the wrong order, or scans state the time
    between beams times an increment.
    """
    lidar = LidarParameters(noise=0.006, noise_growth=0.004)
    still = replace(load_scene(scene, ideal=True), lidar=lidar, base_legs=(), base_repeat=False)
    sensor = SensorModel(joint_rate=100.0)
    seen = simulate(replace(still, base_velocity=velocity), nod, duration, 1, sensor=sensor)
    geometry = ScanGeometry(
        len(seen.azimuth),
        float(seen.azimuth[0]),
        sensor.angle_increment,
        increment * 0.1 / 1024,
        0.02,
        5.6,
    )
    pipeline, watch = Pipeline(PipelineConfig()), SweepAgreement()
    sample_ns = seen.joint_stamp_ns + round(delay * NS_PER_S)
    for stamp_ns, ranges in zip(seen.scan_stamp_ns.tolist(), seen.ranges, strict=True):
        scan = Scan(stamp_ns, geometry, ranges.astype('f4')[:: -1 if backwards else 1])
        end_ns = stamp_ns + int(pipeline.beams(geometry).offset_ns[-1])
        first, last = sample_ns.searchsorted([stamp_ns, end_ns])
        around = slice(max(first - 1, 0), last + 1)
        try:
            watch.add(pipeline.add_scan(scan, sample_ns[around], seen.joint_position[around]))
        except PitchError:
            continue
    return watch


@pytest.fixture(autouse=True)
def short_windows(monkeypatch):
    monkeypatch.setattr(module, 'WINDOW', 4.0)


def test_a_wrong_delay_is_warned_of():
    delay = 8e-3
    watch = watched('room', delay)
    assert abs(watch.delay - delay) < 1e-3
    assert abs(watch.pace - 1.0) < 0.1
    assert 'joint_delay is off' in watch.warning
    assert watch.excludes(0.03)
    assert watch.excludes(-0.03)
    assert not watch.excludes(delay)
    watch.restart()
    assert not watch.excludes(0.03)
    assert not watch.warning


@pytest.mark.parametrize(('scene', 'velocity'), [('room', (0.0, 0.6)), ('corridor', (0.4, 0.0))])
def test_neither_a_right_delay_nor_motion_is_warned_of(scene, velocity):
    assert not watched(scene, 0.0, velocity).warning


@pytest.mark.parametrize('scene', ['room', 'corridor', 'corner'])
def test_ranges_in_the_wrong_order_are_warned_of(scene):
    watch = watched(scene, backwards=True)
    assert watch.pace == pytest.approx(-1.0, abs=0.5)
    assert 'ranges are in the wrong order' in watch.warning
    watch.restart()
    assert not watch.warning


@pytest.mark.parametrize('increment', [0.5, 1.4])
def test_a_wrong_time_between_beams_is_warned_of(increment):
    watch = watched('room', increment=increment)
    assert watch.pace == pytest.approx(1.0 / increment, rel=0.2)
    assert f'time between beams is {watch.pace:.2f} times the time_increment' in watch.warning


def test_a_nod_that_repeats_itself_shows_neither_delay_nor_pace(monkeypatch):
    monkeypatch.setattr(module, 'WINDOW', 20.0)
    nod = Nod(-0.61, 0.61, 0.7, 7 * 1024, 0)  # a sweep is seven revolutions
    watch = watched('room', nod=nod, duration=21.0)
    assert np.isnan([watch.delay, watch.pace]).all()


def test_a_scan_without_a_beam_that_counts_is_taken():
    """At rest the pitch does not change, so no beam shows a delay."""
    geometry = ScanGeometry(682, -2.0, 2.0 * np.pi / 1024, 0.1 / 1024, 0.02, 5.6)
    pipeline, watch = Pipeline(PipelineConfig()), SweepAgreement()
    times_ns = np.array([0, 100_000_000])
    scan = Scan(10_000_000, geometry, np.full(682, 2.0, dtype='f4'))
    watch.add(pipeline.add_scan(scan, times_ns, np.zeros(2)))
    assert not watch.warning
