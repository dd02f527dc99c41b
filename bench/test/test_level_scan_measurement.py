"""Level scans of drives, against rays cast level through the band of the scene."""

from dataclasses import replace

from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_demo.simulated_log import simulated_drive, simulated_log
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

from bench.maps.drives import recorded
from bench.maps.level_scan import judged


def driven(name):
    scene = load_scene(name, ideal=True).with_velocity((0.6, 0.5))
    recording = recorded(scene, 4.0, seed=1)
    return recording.world, simulated_log(recording), simulated_drive(recording)


@pytest.mark.parametrize('mode', ['sweep', 'scan'])
@pytest.mark.parametrize('scene', ['room', 'corridor'])
def test_ranges_are_those_of_level_rays_from_a_robot_that_drives(scene, mode):
    world, uncompensated, log = driven(scene)
    config = LevelScanConfig(level_scan=mode)
    found, other = judged(log, world, config), judged(uncompensated, world, config)
    assert len(found.ranges) >= 3
    assert found.known.min() >= 0.98
    error = np.median(np.abs(found.errors))
    assert error < 0.01
    assert np.median(np.abs(other.errors)) > 2.0 * error


def test_beams_that_the_lidar_lost_show_what_is_free_or_nothing():
    world, _, log = driven('corridor')
    scans = [
        replace(scan, ranges=np.where(scan.ranges > 3.0, np.float32(np.nan), scan.ranges))
        for scan in log.scans
    ]
    log = replace(log, scans=scans)
    free, strict = (
        judged(log, world, LevelScanConfig(level_scan='sweep', lost_beams_are_free=each))
        for each in (True, False)
    )
    far = free.truth > 3.6  # where the nearest surface of the band was lost
    assert np.mean(far) > 0.1
    assert np.mean(np.isposinf(free.ranges[far])) > 0.9
    assert np.mean(np.isnan(strict.ranges[far])) > 0.5
    # What is nearer was seen from within 3 m, on a slant of 0.61 rad and 0.55 m farther back.
    assert free.free_in_front_of(3.0 * np.cos(0.61) - 0.55) < 0.002


def test_devices_with_errors_leave_few_azimuths_unknown():
    recording = recorded(load_scene('corridor'), 4.0, seed=2)
    log = simulated_drive(recording)
    found = judged(log, recording.world, LevelScanConfig(level_scan='sweep'))
    assert found.known.min() >= 0.98
    assert np.median(np.abs(found.errors)) < 0.02
