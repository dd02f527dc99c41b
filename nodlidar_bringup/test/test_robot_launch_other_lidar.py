"""The launch file with lidars that see all around, simulated: an LD19, and an RPLIDAR's driver."""

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.world import World
import numpy as np
from observer import Observer
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2
from sensor_msgs_py import point_cloud2


@pytest.mark.parametrize(('lidar', 'beams'), [('rplidar', 720), ('LD19', 450)])
def test_clouds_lie_on_the_room_all_around(tmp_path, lidar, beams):
    observer, log = Observer(), tmp_path / 'launch.log'
    observer.subscribe(LaserScan, 'scan')
    observer.subscribe(PointCloud2, 'points')
    scans, clouds = observer.messages['scan'], observer.messages['points']
    with launched_sensor(log, f'lidar:={lidar}', 'scene:=room', 'ideal:=true') as running:
        observer.spin_until(lambda: len(clouds) >= 50 or not running.running(), 'clouds')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    assert {scan.header.frame_id for scan in scans} == {'laser'}
    assert np.mean([len(scan.ranges) for scan in scans]) == pytest.approx(beams, rel=0.01)
    points = np.concatenate(
        [point_cloud2.read_points_numpy(each, field_names=['x', 'y', 'z']) for each in clouds]
    ).astype(np.float64)
    azimuth, height = np.arctan2(points[:, 1], points[:, 0]), points[:, 2]
    assert np.histogram(azimuth, 8, (-np.pi, np.pi))[0].min() > len(points) / 20
    assert np.ptp(height) > 1.0  # it nods
    world = World(load_scene('room', ideal=True), IdealServo())
    distance = world.surface_distance(points, np.array([0]))
    # Stamps are up to 2 ms off; with the beams in the wrong order it would be ten times as much.
    assert np.sqrt(np.mean(distance**2)) < 0.01
