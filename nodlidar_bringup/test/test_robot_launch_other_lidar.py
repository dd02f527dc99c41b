"""The launch file with an RPLIDAR's driver, simulated."""

from nodlidar_bringup.ros.launched import launched_sensor
from observer import Observer
from on_the_room import assert_on_the_room_all_around, CLOUDS
from sensor_msgs.msg import LaserScan, PointCloud2


def test_clouds_lie_on_the_room_all_around(tmp_path):
    observer, log = Observer(), tmp_path / 'launch.log'
    observer.subscribe(LaserScan, 'scan')
    observer.subscribe(PointCloud2, 'points')
    scans, clouds = observer.messages['scan'], observer.messages['points']
    with launched_sensor(log, 'lidar:=rplidar', 'scene:=room', 'ideal:=true') as running:
        observer.spin_until(lambda: len(clouds) >= CLOUDS or not running.running(), 'clouds')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    assert {scan.header.frame_id for scan in scans} == {'laser'}
    assert_on_the_room_all_around(scans, 720, clouds)
