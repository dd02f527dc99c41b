"""Rays that octomap_server and Nav2 cast, from a cloud's frame to its points, in the scene."""

from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_sim.world.planar import rotate, to_parent
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

from bench.maps.drives import CONFIG, recorded

CELL = 0.1  # m


@pytest.fixture(params=['room', 'building'])
def drive(request):
    route = 'figure_of_eight' if request.param == 'room' else None
    recording = recorded(load_scene(request.param, route, ideal=True), 8.0, seed=1)
    log = simulated_drive(recording)
    return recording.world, clouds_in(log, CONFIG)[0][2:]


def off(world, stamp_ns, points):
    """Return by how much rays from the mount at an instant pass their points, in metres."""
    length = np.linalg.norm(points, axis=1)
    times, mount = np.full(len(points), stamp_ns), world.scene.mount
    pose = world.base.poses(times)
    origins = to_parent(mount.to_parent(np.zeros_like(points)), pose)
    ways = rotate(mount.directions_to_parent(points / length[:, None]), pose[:, 2])
    return world.distances(origins, ways, times) - length


def test_rays_from_the_frame_of_a_cloud_at_its_stamp_end_at_its_points(drive):
    """But for points behind an edge, which the lidar saw from elsewhere in the sweep."""
    world, clouds = drive
    assert len(clouds) >= 4
    for cloud in clouds:
        found = off(world, cloud.stamp_ns, cloud.xyz)
        assert np.median(np.abs(found)) < 0.001
        assert np.mean(np.abs(found) > CELL) < 0.04


def test_at_the_stamp_of_the_first_point_they_would_not(drive):
    world, clouds = drive
    cloud = clouds[0]
    found = off(world, int(cloud.time_ns[0]), cloud.xyz)
    assert np.mean(np.abs(found) > CELL) > 0.1
