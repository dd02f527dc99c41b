"""Level scans, against rays cast level through the band of the simulator's scene."""

from dataclasses import replace

from node_bench import sensor_log, simulated
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.clouds.level_scan import LevelScanner
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_sim.world.base import rotate, to_parent
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

HEIGHTS = np.linspace(-0.9, 0.999, 40)  # of the default band, in nodlidar_base_link


def level_scans(recording, config, compensated=True):
    x, y, yaw = recording.odometry_pose.T
    zero = np.zeros_like(x)
    turns = np.stack([zero, zero, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)
    base = Odometry(recording.odometry_stamp_ns, Poses(np.stack([x, y, zero], axis=1), turns))
    odometry = base.mounted(recording.world.scene.mount) if compensated else None
    log, pipeline, found = sensor_log(recording), Pipeline(PipelineConfig()), []
    scanner = LevelScanner(config)
    for scan in log.scans:
        end_ns = scan.stamp_ns + pipeline.beams(scan.geometry).duration_ns
        around = log.samples_around(scan.stamp_ns, end_ns)
        samples = log.sample_ns[around], log.sample_pitch[around]
        found += scanner.add(pipeline.add_scan(scan, *samples, odometry))
    return found


def rays(world, stamp_ns, config):
    """Return the nearest range of level rays in the band, per azimuth, inf beyond range_max."""
    azimuth = -config.level_scan_angle + config.increment * np.arange(config.level_scan_beams)
    each, heights = np.repeat(azimuth, len(HEIGHTS)), np.tile(HEIGHTS, len(azimuth))
    zero = np.zeros_like(each)
    pose, mount = world.base.poses(np.array([stamp_ns])), world.scene.mount
    origins = to_parent(mount.to_parent(np.stack([zero, zero, heights], axis=1)), pose)
    ways = mount.directions_to_parent(np.stack([np.cos(each), np.sin(each), zero], axis=1))
    times = np.full(len(each), stamp_ns)
    ranges = world.distances(origins, rotate(ways, pose[:, 2]), times)
    nearest = ranges.reshape(-1, len(HEIGHTS)).min(axis=1)
    return np.where(nearest > config.level_scan_range, np.inf, nearest)


@pytest.mark.parametrize('mode', ['sweep', 'scan'])
@pytest.mark.parametrize('scene', ['room', 'corridor'])
def test_ranges_are_those_of_level_rays_from_a_robot_that_drives(scene, mode):
    moving = replace(load_scene(scene, ideal=True), base_legs=(), base_repeat=False)
    recording = simulated(replace(moving, base_velocity=(0.6, 0.5)), 2.0)
    config = LevelScanConfig(level_scan=mode)
    errors = {}
    for compensated in (True, False):
        found = level_scans(recording, config, compensated)
        assert len(found) >= 3
        differences = []
        for scan in found:
            expected = rays(recording.world, scan.stamp_ns, config)
            assert np.mean(~np.isnan(scan.ranges)) >= 0.98 or not compensated
            both = np.isfinite(scan.ranges) & np.isfinite(expected)
            differences.append(np.abs(scan.ranges[both] - expected[both]))
        errors[compensated] = np.median(np.concatenate(differences))
    assert errors[True] < 0.01
    assert errors[False] > 2.0 * errors[True]
