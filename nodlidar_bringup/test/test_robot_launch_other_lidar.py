"""The launch file with a lidar that has a driver of its own, both simulated."""

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.world import World
import numpy as np
from observer import Observer
from sensor_msgs.msg import LaserScan, PointCloud2
from sensor_msgs_py import point_cloud2


def test_clouds_of_an_rplidar_lie_on_the_room_all_around(tmp_path):
    observer, log = Observer(), tmp_path / 'launch.log'
    observer.subscribe(LaserScan, 'scan')
    observer.subscribe(PointCloud2, 'points')
    scans, clouds = observer.messages['scan'], observer.messages['points']
    with launched_sensor(log, 'lidar:=rplidar', 'scene:=room', 'ideal:=true') as running:
        observer.spin_until(lambda: len(clouds) >= 50 or not running.running(), 'clouds')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    assert {(scan.header.frame_id, len(scan.ranges)) for scan in scans} == {('laser', 720)}
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
