"""The node with clouds of a sensor, and browsers that come and go."""

from dataclasses import dataclass
import re

from browser import browsing
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped
from lifecycle_msgs.srv import ChangeState
from nav_msgs.msg import Path
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.parameters import parameter
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.node_parameters import declare
from nodlidar_msgs.msg import Coverage
from nodlidar_viewer import words
from nodlidar_viewer.ros import view
from nodlidar_viewer.ros.node import ViewerNode
from nodlidar_viewer.state_panel import NO_COVERAGE
import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from sensor_msgs_py.point_cloud2 import create_cloud
from std_msgs.msg import Header
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster

START_NS = 1_700_000_000 * 10**9
ARGUMENTS = ['-p', 'host:=127.0.0.1', '-p', 'port:=18180', '-p', 'frame_rate:=20.0']
FIELDS = [PointField(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate('xyz')]


POINT = np.dtype([(axis, 'f4') for axis in 'xyz'])


class Sensor(Node):
    """Sends what a sensor sends."""

    def __init__(self):
        super().__init__('assembler')
        self.clouds = self.create_publisher(PointCloud2, 'points', 10)
        self.scans = self.create_publisher(LaserScan, 'scan', 10)
        self.coverage = self.create_publisher(Coverage, '~/coverage', 10)
        self.states = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._static = StaticTransformBroadcaster(self)
        self._static.sendTransform(self._above('base_link', 'nodlidar_base_link'))
        self._static.sendTransform(self._above('nodlidar_base_link', 'laser'))
        self.count = 0

    def _above(self, parent, child):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = parent
        transform.transform.translation.z = 0.5
        transform.transform.rotation.w = 1.0
        return transform

    def cloud(self, value):
        """Return a cloud of 100 points whose coordinates have a value, or one each [m]."""
        stamp = time_message(START_NS + self.count * 50_000_000)
        header = Header(stamp=stamp, frame_id='nodlidar_base_link')
        return create_cloud(header, FIELDS, np.full(100, value, dtype=POINT))

    def send(self):
        """Send a cloud, a scan and states."""
        self.count += 1
        cloud = self.cloud(2.0)
        self.clouds.publish(cloud)
        cloud.data = cloud.data[:5]
        self.clouds.publish(cloud)  # malformed
        scan = LaserScan(ranges=[1.0] * 40, angle_increment=0.01, range_min=0.1)
        scan.header.frame_id = 'laser'
        self.scans.publish(scan)
        self.coverage.publish(Coverage(seen=0.75, window=10.0, cell=0.05, largest_hole=0.1))
        status = DiagnosticStatus(level=b'\2', name='servo: device', message='no torque')
        self.states.publish(DiagnosticArray(status=[status]))


@pytest.fixture
def running():
    rclpy.init(args=['--ros-args', *ARGUMENTS])
    sensor, viewer, executor = Sensor(), ViewerNode(), Executor()
    for node in (sensor, viewer):
        executor.add_node(node)

    def spin():
        executor.spin_once(timeout_sec=0.02)

    yield sensor, viewer, spin
    executor.shutdown()
    for node in (sensor, viewer):
        node.destroy_node()
    rclpy.shutdown()


def test_it_listens_only_while_somebody_looks(running):
    sensor, viewer, spin = running
    assert sensor.clouds.get_subscription_count() == 0

    def work():
        sensor.send()
        spin()

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: browser.of('PointCloudMessage'), work)
        browser.until(lambda: browser.of('MeshMessage'), work)
        browser.until(lambda: '75.0%' in browser.text(), work)
        browser.until(lambda: 'no torque' in browser.text(), work)
        name, ply = viewer._saved()
        assert name.endswith('.ply')
        assert b'frame base_link' in ply
        assert viewer._view.recent.points[:, 2].min() == 2.5  # the nod axis is 0.5 m up
    for _ in range(500):
        spin()
        if sensor.clouds.get_subscription_count() == 0:
            break
    assert sensor.clouds.get_subscription_count() == 0
    assert not viewer.survival.errors


def test_points_that_are_nowhere_are_left_out(running):
    sensor, viewer, spin = running
    nowhere = [np.nan, np.inf, -3e38, 3e38]
    map_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    maps = sensor.create_publisher(PointCloud2, 'map_cloud', map_qos)
    maps.publish(sensor.cloud(np.resize(nowhere, 100)))

    def work():
        for value in nowhere:
            sensor.clouds.publish(sensor.cloud(value))
        sensor.send()
        spin()

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: browser.of('PointCloudMessage'), work)
        browser.until(lambda: 'no torque' in browser.text(), work)
        assert set(viewer._view.recent.points.ravel()) == {2.0, 2.5}
        maps.publish(PointCloud2(header=sensor.cloud(2.0).header, width=1, height=1))  # malformed
        sensor.states.publish(
            DiagnosticArray(status=[DiagnosticStatus(name='mapper', message='still here')])
        )
        browser.until(lambda: 'still here' in browser.text(), work)
    assert not viewer.survival.errors


def test_a_cloud_that_raises_an_error_holds_up_no_other(running, monkeypatch):
    sensor, viewer, spin = running
    whole, calls = view.coordinates, []

    def fails_first(message):
        calls.append(message)
        if message is calls[0]:
            raise ArithmeticError
        return whole(message)

    monkeypatch.setattr(view, 'coordinates', fails_first)

    def work():
        sensor.send()
        spin()

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: browser.of('PointCloudMessage'), work)
    assert viewer.survival.errors.total() == 1


def test_a_stamp_before_time_began_is_told(running):
    sensor, viewer, spin = running
    cloud = sensor.cloud(2.0)
    cloud.header.stamp.sec = -5

    def work():
        sensor.clouds.publish(cloud)
        spin()

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: 'before time began' in browser.text(), work)
        browser.until(lambda: browser.of('PointCloudMessage'), lambda: (sensor.send(), spin()))
    assert not viewer.survival.errors


def test_transforms_are_those_of_the_present_when_time_goes_back(running):
    """As when a bag begins again: a minute later, its clouds are where the robot is then."""
    sensor, viewer, spin = running
    broadcaster = TransformBroadcaster(sensor)

    def work():
        sensor.count += 1
        cloud = sensor.cloud(2.0)
        cloud.header.frame_id = 'turret'
        moved = TransformStamped(header=Header(stamp=cloud.header.stamp, frame_id='base_link'))
        moved.child_frame_id = 'turret'
        moved.transform.translation.x, moved.transform.rotation.w = place, 1.0
        broadcaster.sendTransform(moved)
        sensor.clouds.publish(cloud)
        spin()

    def shown():
        return set(viewer._view.recent.points[:, 0]) if viewer._view else set()

    with browsing(viewer.page.address) as browser:
        for begin, place in ((1200, 1.0), (0, 7.0)):
            sensor.count = begin
            browser.until(lambda at=2.0 + place: shown() == {at}, work)
    assert not viewer.survival.errors


def test_a_map_that_comes_before_its_frame_is_drawn_with_it(running):
    """It is sent only once, where it does not change any more."""
    sensor, viewer, spin = running
    map_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    cloud, path = sensor.cloud(2.0), Path(poses=[PoseStamped(), PoseStamped()])
    cloud.header.frame_id = path.header.frame_id = 'map'
    for kind, topic, message in ((PointCloud2, 'map_cloud', cloud), (Path, 'path', path)):
        sensor.create_publisher(kind, topic, map_qos).publish(message)

    def names(browser):
        return {message.get('name') for message in browser.messages}

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: viewer._view and len(viewer._view._undrawn) == 2, spin)
        assert not names(browser) & {'/map', '/path'}
        sensor._static.sendTransform(sensor._above('map', 'base_link'))
        browser.until(lambda: names(browser) >= {'/map', '/path'}, spin)
    assert not viewer.survival.errors


def test_a_page_that_has_just_gone_saves_no_points(running):
    _, viewer, _ = running
    name, ply = viewer._saved()
    assert (name, b'element vertex 0' in ply) == ('points.ply', True)


def test_the_frame_that_clouds_lack_is_told_though_scans_come(running):
    sensor, viewer, spin = running

    def work():
        sensor.count += 1
        cloud = sensor.cloud(2.0)
        cloud.header.frame_id = 'turret'
        sensor.clouds.publish(cloud)
        scan = LaserScan(ranges=[1.0] * 40, angle_increment=0.01, range_min=0.1, range_max=9.0)
        scan.header.frame_id = 'laser'
        sensor.scans.publish(scan)
        spin()

    with browsing(viewer.page.address) as browser:
        browser.until(lambda: browser.of('MeshMessage'), work)
        browser.until(lambda: re.search(r'No cloud for .*turret', browser.text()), work)


def test_coverage_that_is_not_heard_any_more_is_not_shown(running, monkeypatch):
    monkeypatch.setattr(words, 'SILENT', 0.5)
    sensor, viewer, spin = running
    with browsing(viewer.page.address) as browser:
        browser.until(lambda: '75.0%' in browser.text(), lambda: (sensor.send(), spin()))
        shown = len(browser.messages)

        def is_forgotten():
            return any(NO_COVERAGE in str(m.get('updates')) for m in browser.messages[shown:])

        browser.until(is_forgotten, spin)


def test_what_is_missing_is_told(running):
    _, viewer, spin = running
    with browsing(viewer.page.address) as browser:
        browser.until(lambda: 'No cloud for' in browser.text(), spin)
    assert not viewer.survival.errors


@dataclass(frozen=True)
class Controlled(NodConfig):
    """The parameters that the page controls."""

    adapt_limits: bool = parameter(False, 'Limits follow the range', live=True)
    profile: str = parameter('balanced', 'Profile', live=True)


def test_a_browser_of_this_machine_plans_another_nod(running):
    sensor, viewer, spin = running
    planned = []
    declare(sensor, Controlled, planned.append)
    with browsing(viewer.page.address) as browser:
        browser.until(lambda: 'Apply' in browser.text(), spin)
        browser.set('N_s', 3001)
        browser.set('Mode', 'feedback')
        browser.set('Profile', 'slam')
        browser.set('Apply', True)
        browser.until(lambda: 'applied' in browser.text(), spin)
        [nod] = planned
        assert (nod.samples_per_sweep, nod.nod_mode, nod.profile) == (3001, 'feedback', 'slam')
        # What somebody else has set meanwhile stays.
        sensor.set_parameters([Parameter('profile', value='fast')])
        browser.set('N_s', 3003)
        browser.set('Apply', True)
        browser.until(lambda: planned[-1].samples_per_sweep == 3003, spin)
        assert planned[-1].profile == 'fast'
        browser.set('Object [m]', 9.0)
        browser.set('Apply', True)
        browser.until(lambda: 'refused' in browser.text(), spin)
        browser.set('Object [m]', 0.3)
        before = len(browser.messages)
        browser.set('Choose N_s for it', True)

        def chosen():
            updates = [m.get('updates', {}) for m in browser.messages[before:]]
            return [u['value'] for u in updates if isinstance(u.get('value'), int)]

        browser.until(chosen, spin)
        assert chosen()[-1] > 1000
        browser.set('Devices', 'stop')
        browser.until(
            lambda: 'driver: does not answer; servo: does not answer' in browser.text(), spin
        )
    assert len(planned) == 3
    assert not viewer.survival.errors


def test_a_node_that_is_there_but_stalled_does_not_answer(running):
    """Nobody spins this driver; that of a node that was killed looks the same for a while."""
    sensor, viewer, spin = running
    declare(sensor, Controlled, lambda config: None)
    stalled = rclpy.create_node('driver')
    stalled.create_service(ChangeState, 'driver/change_state', lambda request, response: response)
    with browsing(viewer.page.address) as browser:
        browser.until(lambda: 'Apply' in browser.text(), spin)
        browser.until(lambda: viewer.count_services('/driver/change_state'), spin)
        browser.set('Devices', 'stop')
        browser.until(lambda: 'driver: does not answer' in browser.text(), spin)
    stalled.destroy_node()
    assert not viewer.survival.errors
