"""The launch file of the mapper: a drive through the building, without errors of the devices."""

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_common.stamps import time_ns
import numpy as np
from observer import Observer
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_the_robot_is_found_in_a_map_that_grows(tmp_path):
    observer = Observer()
    observer.subscribe(PoseWithCovarianceStamped, 'pose')
    observer.subscribe(Odometry, 'odom', 2000)
    observer.subscribe(OccupancyGrid, 'map', LATCHED)
    observer.subscribe(DiagnosticArray, '/diagnostics')
    poses, maps, odometry = map(observer.messages.get, ('pose', 'map', 'odom'))
    params = tmp_path / 'mapper.yaml'
    params.write_text('/**: {ros__parameters: {map_period: 1.0}}')
    arguments = 'ideal:=true', f'mapper_params:={params}', f'save:={tmp_path / "maps"}'
    with launched_sensor(tmp_path / 'launch.log', *arguments, file='mapping.launch.py') as running:
        enough = lambda: len(poses) > 4 and len(maps) > 1  # noqa: E731
        observer.spin_until(lambda: enough() or not running.running(), 'poses and maps')
        assert running.running(), running.log.read_text()
        joined = observer.transforms.can_transform('map', 'laser', Time())
        assert joined
        assert running.interrupt() == 0, running.log.read_text()
    observer.close()
    assert len([*(tmp_path / 'maps').glob('*/keyframes.npz')]) == 1
    stamps_ns = [time_ns(message.header.stamp) for message in odometry]
    for message in poses:
        assert message.header.frame_id == 'map'
        at_ns, place = time_ns(message.header.stamp), message.pose.pose.position
        x = np.interp(at_ns, stamps_ns, [m.pose.pose.position.x for m in odometry], np.nan, np.nan)
        y = np.interp(at_ns, stamps_ns, [m.pose.pose.position.y for m in odometry], np.nan, np.nan)
        # NaN before the first odometry. Along a corridor, a match errs by some centimetres.
        assert not np.hypot(place.x - x, place.y - y) > 0.1
    cells = np.array(maps[-1].data)
    assert (cells == 0).sum() > 1000
    assert (cells == 100).sum() > 50
    reports = [s for m in observer.messages['/diagnostics'] for s in m.status]
    words = [s.message for s in reports if s.name == 'mapper: map']
    assert 'the robot is found in the map' in words
