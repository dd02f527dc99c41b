"""What clouds of the room have in common."""

from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.world import World
import numpy as np
import pytest

CLOUDS = 50  # two sweeps and more


def assert_on_the_room(clouds, within):
    """Clouds are nodded, and on the room within an RMS distance [m]; return their points."""
    points = np.concatenate([coordinates(each) for each in clouds])
    assert np.ptp(points[:, 2]) > 1.0  # it nods
    world = World(load_scene('room', ideal=True), IdealServo())
    distance = world.surface_distance(points, np.array([0]))
    assert np.sqrt(np.mean(distance**2)) < within
    return points


def assert_on_the_room_all_around(scans, beams, clouds):
    """Scans have so many beams; clouds are all around, nodded, and on the surfaces of the room."""
    assert np.mean([len(scan.ranges) for scan in scans]) == pytest.approx(beams, rel=0.01)
    # Stamps are up to 2 ms off; with the beams in the wrong order it would be ten times as much.
    points = assert_on_the_room(clouds, within=0.01)
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    assert np.histogram(azimuth, 8, (-np.pi, np.pi))[0].min() > len(points) / 20
