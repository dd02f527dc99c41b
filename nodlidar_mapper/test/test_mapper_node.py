"""The node with clouds of a room: the map, services, and what goes wrong."""

from dataclasses import replace
from pathlib import Path
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.msg import Path as PathMessage
from nodlidar_common.errors import ParameterError
from nodlidar_common.pose import Pose
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import time_message, transform_message
from nodlidar_common.stamps import time_ns
from nodlidar_common.time_order import LEAST_TO_JUMP
from nodlidar_mapper.geometry.poses import inverse, planar
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.mapper import FIRST
from nodlidar_mapper.output import saved_map
from nodlidar_mapper.output.map_folder import load
from nodlidar_mapper.ros import cloud_input, diagnosis, kept_map, map_output, messages
from nodlidar_mapper.ros.cloud_input import (
    BEHIND,
    BUSY,
    LOST,
    MOST_FRAMES,
    MOST_READY,
    NO_ODOMETRY,
    OF_OTHERS,
)
from nodlidar_mapper.ros.node import MapperNode
from nodlidar_msgs.srv import MapFolder
import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rooms import cloud, CROOKED
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from tf2_ros import Buffer, TransformBroadcaster, TransformListener

LONGEST = 60.0  # s; only a failing test waits so long
START_NS = 1_700_000_000 * 10**9
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FILES = {'keyframes.npz', 'map.pgm', 'map.png', 'map.ply', 'map.yaml', 'trajectory.txt'}
DRIFT = planar(0.05, -0.04, 0.02)  # of odometry, between the first cloud and the others


class Robot(Node):
    """Sends clouds of the room and odometry, and hears the mapper."""

    def __init__(self):
        super().__init__('robot')
        self._tf = TransformBroadcaster(self)
        self._clouds = self.create_publisher(PointCloud2, 'points', 10)
        self.others = self.create_publisher(PointCloud2, 'other/points', 10)
        self.given = self.create_publisher(PoseWithCovarianceStamped, 'initialpose', 1)
        self.transforms = Buffer()
        self._listener = TransformListener(self.transforms, self)
        self.heard = {'pose': [], 'map': [], 'path': [], '/diagnostics': []}
        for kind, topic, qos in [
            (PoseWithCovarianceStamped, 'pose', 10),
            (OccupancyGrid, 'map', LATCHED),
            (PathMessage, 'path', LATCHED),
            (DiagnosticArray, '/diagnostics', 10),
        ]:
            self.create_subscription(kind, topic, self.heard[topic].append, qos)
        self.requests = {
            name: self.create_client(MapFolder, f'mapper/{name}')
            for name in ('save_map', 'load_map')
        }
        self.seed = 0
        self.late_ns = 0  # odometry

    def send(self, seconds, pose, odometry, frame='base_link'):
        """Send a cloud that was taken at a pose, and odometry."""
        self.send_odometry(seconds, odometry)
        self.send_cloud(seconds, pose, frame)

    def send_odometry(self, seconds, odometry):
        stamp_ns = START_NS + round(seconds * 1e9)
        for k in range(LEAST_TO_JUMP):  # so that time may jump with any cloud
            sent_ns = stamp_ns + self.late_ns + (k + 1 - LEAST_TO_JUMP) * 10**7
            place = Pose(odometry[:3, 3], odometry[:3, :3])
            transform = transform_message(sent_ns, 'odom', 'base_link', place)
            self._tf.sendTransform(transform)

    def send_cloud(self, seconds, pose, frame='base_link', publisher=None):
        self.seed += 1
        stamp_ns = START_NS + round(seconds * 1e9)
        points = cloud(CROOKED, pose, seed=self.seed)
        message = messages.surface_message(Surface(points, points), stamp_ns, frame)
        (publisher or self._clouds).publish(message)

    def send_two(self, first, second):
        """Send a cloud on both topics, or on one."""
        message = messages.surface_message(Surface(*np.ones((2, 9, 3))), START_NS, 'base_link')
        for publisher in [self._clouds] * first + [self.others] * second:
            publisher.publish(message)

    def send_malformed(self, seconds):
        message = messages.surface_message(
            Surface(np.ones((9, 3)), np.ones((9, 3))), START_NS + round(seconds * 1e9), 'base_link'
        )
        message.data = message.data[:7]
        self._clouds.publish(message)
        message.header.stamp.sec = -5
        self._clouds.publish(message)

    def send_unstamped(self):
        points = Surface(*np.ones((2, 9, 3)))
        self._clouds.publish(messages.surface_message(points, 0, 'base_link'))

    def reports(self):
        return [status for m in self.heard['/diagnostics'] for status in m.status]

    def words(self):
        return [status.message for status in self.reports()]


@pytest.fixture
def in_tmp_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def running(request):
    rclpy.init(args=['--ros-args', *getattr(request, 'param', [])])
    robot, mapper, executor = Robot(), MapperNode(), Executor()
    for node in (robot, mapper):
        executor.add_node(node)

    def until(condition):
        end = time.monotonic() + LONGEST
        while not condition():
            assert time.monotonic() < end, mapper.clouds.drops
            executor.spin_once(timeout_sec=0.05)

    until(lambda: mapper.count_publishers('points') and robot.count_publishers('map'))
    # Nobody hears what is sent before. The robot hears its own transforms, too.
    hearers = {'/points': 1, '/initialpose': 1, '/tf': 2}
    sending = [each for each in robot.publishers if each.topic_name in hearers]
    until(lambda: all(p.get_subscription_count() >= hearers[p.topic_name] for p in sending))
    yield robot, mapper, until
    executor.shutdown()
    for node in (robot, mapper):
        node.destroy_node()
    rclpy.shutdown()


def seconds_of(stamp_ns):
    return (stamp_ns - START_NS) / 1e9


def match(running, seconds, pose, odometry):
    """Send a cloud, wait until it was matched and, if it fits, until its pose was heard."""
    robot, mapper, until = running

    def snapshot():
        found = mapper.output.snapshot
        return found if found and seconds_of(found.estimate.stamp_ns) == seconds else None

    robot.send(seconds, pose, odometry)
    until(snapshot)
    estimate, heard = snapshot().estimate, robot.heard['pose']
    if not estimate.lost:
        until(lambda: heard and seconds_of(time_ns(heard[-1].header.stamp)) == seconds)
    return estimate


def drive(running, begin, poses, odometry):
    """Send clouds one by one, each after the last one was matched."""
    pairs = zip(poses, odometry, strict=True)
    return [match(running, begin + k, *pair) for k, pair in enumerate(pairs)]


def call(robot, until, name, folder):
    until(robot.requests[name].service_is_ready)
    future = robot.requests[name].call_async(MapFolder.Request(folder=str(folder)))
    until(future.done)
    return future.result()


def place_of(message):
    return messages.matrix_of_pose(message.pose.pose)


def test_a_map_is_made_saved_and_loaded(running, tmp_path, monkeypatch):
    robot, _, until = running
    refused = call(robot, until, 'save_map', tmp_path / 'none')
    assert not refused.success
    assert 'no cloud was matched' in refused.message
    poses = [planar(0.3 * k, 0.05 * k, 0.1 * k) for k in range(6)]
    odometry = [poses[0], *(DRIFT @ pose for pose in poses[1:])]
    drive(running, 0, poses, odometry)
    np.testing.assert_allclose(place_of(robot.heard['pose'][-1]), poses[-1], atol=0.03)
    until(lambda: robot.heard['map'] and robot.transforms.can_transform('map', 'odom', Time()))
    found = messages.matrix_of(robot.transforms.lookup_transform('map', 'odom', Time()))
    np.testing.assert_allclose(found, inverse(DRIFT), atol=0.03)
    cells = np.array(robot.heard['map'][-1].data)
    assert {-1, 0, 100} == set(cells)
    monkeypatch.chdir(tmp_path)  # the folder of whoever started the node
    saved = call(robot, until, 'save_map', 'map')
    assert saved.success, saved.message
    assert saved.message.endswith(f"points saved in '{tmp_path / 'map'}'")
    assert {path.name for path in (tmp_path / 'map').iterdir()} == FILES
    # The robot was carried while the mapper had another map: it is found by its clouds.
    loaded = call(robot, until, 'load_map', tmp_path / 'map')
    assert loaded.success, loaded.message
    refused = call(robot, until, 'save_map', tmp_path / 'none')
    assert refused.message.endswith('no cloud was matched since the start or load_map')
    carried, counted = planar(-1.5, -1.0, -2.5), planar(3.0, 3.0, 1.0)
    assert not drive(running, 10, [carried] * 4, [counted] * 4)[-1].lost
    np.testing.assert_allclose(place_of(robot.heard['pose'][-1]), carried, atol=0.03)
    missing = call(robot, until, 'load_map', tmp_path / 'nowhere')
    assert not missing.success
    path = tmp_path / 'nowhere/keyframes.npz'
    assert missing.message == f"No such file or directory: '{path}'"


@pytest.mark.parametrize('name', ['save_map', 'load_map'])
def test_all_requests_that_come_at_once_are_answered(running, tmp_path, name):
    robot, mapper, until = running
    until(robot.requests[name].service_is_ready)
    request = MapFolder.Request(folder=str(tmp_path / 'none'))
    sent = [robot.requests[name].call_async(request) for _ in range(50)]
    until(lambda: mapper.answering)  # the node does not end before
    until(lambda: all(future.done() for future in sent))
    assert not any(future.result().success for future in sent)
    assert not mapper.answering


def test_what_was_asked_for_is_done_although_the_node_ends(running, tmp_path):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 3, [np.eye(4)] * 3)
    go_on = threading.Event()
    until(robot.requests['save_map'].service_is_ready)
    until(lambda: not mapper.output._thread.busy)
    mapper.output._thread.start(go_on.wait, lambda _: None)
    for name in ('one', 'other'):
        robot.requests['save_map'].call_async(MapFolder.Request(folder=str(tmp_path / name)))
    until(lambda: len(mapper.output._requests) == 2)
    go_on.set()
    mapper.output.end()
    assert {each.name for each in tmp_path.iterdir()} == {'one', 'other'}


OVERRIDES = [
    word
    for name in ('map.publisher', 'pose.publisher', 'initialpose.subscription')
    for word in ('-p', f'qos_overrides./{name}.reliability:=best_effort')
]


@pytest.mark.parametrize('running', [OVERRIDES], indirect=True)
def test_the_qos_of_a_topic_is_overridden_and_no_other_s(running):
    _, mapper, _ = running
    publishers, subscriptions = (
        mapper.get_publishers_info_by_topic,
        mapper.get_subscriptions_info_by_topic,
    )
    for find, topic, expected in (
        (publishers, '/map', 'BEST_EFFORT'),
        (publishers, '/path', 'RELIABLE'),
        (publishers, '/pose', 'BEST_EFFORT'),
        (subscriptions, '/initialpose', 'BEST_EFFORT'),
    ):
        (found,) = [each for each in find(topic) if each.node_name == 'mapper']
        assert found.qos_profile.reliability == ReliabilityPolicy[expected]


@pytest.mark.parametrize('running', [['-p', 'save_folder:=maps']], indirect=True)
@pytest.mark.usefixtures('in_tmp_path')
def test_the_map_is_saved_when_the_node_ends_and_never_over_another_one(running, tmp_path):
    _, mapper, _ = running
    mapper.output.end()  # of a node without a map: there is nothing to save
    assert not [*(tmp_path / 'maps').iterdir()]
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    written, write = [], saved_map.whole_file
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(saved_map, 'whole_file', lambda path: written.append(path) or write(path))
        mapper.output.end()
    (folder,) = (tmp_path / 'maps').iterdir()
    assert len(load(folder)[0]) == 1
    assert {path.name for path in folder.iterdir()} == FILES
    assert written == [Path('maps') / folder.name / 'keyframes.npz']  # once


@pytest.mark.parametrize('running', [['-p', 'save_folder:=maps']], indirect=True)
@pytest.mark.parametrize('at_once', [True, False])
@pytest.mark.usefixtures('in_tmp_path')
def test_the_map_before_load_map_is_saved_too(running, tmp_path, at_once):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    assert call(robot, until, 'save_map', 'base').success
    moved = [planar(0.6, 0.0, 0.0)]
    drive(running, 2, moved, moved)
    assert call(robot, until, 'load_map', 'base').success
    if not at_once:
        until(lambda: [*(tmp_path / 'maps').glob('*/map.ply')])
    drive(running, 3, [np.eye(4)], [np.eye(4)])
    mapper.output.end()
    folders = sorted((tmp_path / 'maps').iterdir())
    assert [{path.name for path in folder.iterdir()} for folder in folders] == [FILES, FILES]
    keyframes = [load(folder)[0] for folder in folders]
    assert sorted(map(len, keyframes)) == [1, 2]


@pytest.mark.parametrize('running', [['-p', 'save_folder:=maps']], indirect=True)
@pytest.mark.usefixtures('in_tmp_path')
def test_of_a_node_that_is_killed_the_keyframes_are_saved(running, tmp_path):
    _, mapper, until = running

    def saved():
        return [*(tmp_path / 'maps').glob('*/*')]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept_map, 'PERIOD', 0.0)
        mapper.output.begin()
        drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
        until(saved)  # while it drives
    (file,) = saved()
    assert len(load(file.parent)[0]) == 1
    mapper.output.kept._after_ns = 2**63
    drive(running, 2, [planar(0.6, 0.0, 0.0)], [planar(0.6, 0.0, 0.0)])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept_map, 'save', lambda *_, **__: 1 / 0)  # killed while it saves the rest
        with pytest.raises(ZeroDivisionError):
            mapper.output.end()
    assert saved() == [file]
    assert len(load(file.parent)[0]) == 2


@pytest.mark.usefixtures('in_tmp_path')
def test_a_folder_in_which_no_map_can_be_saved_is_refused_at_the_start(tmp_path):
    (tmp_path / 'maps').touch()
    rclpy.init(args=['--ros-args', '-p', 'save_folder:=maps'])
    try:
        with pytest.raises(ParameterError, match="'save_folder' must be a folder for maps"):
            MapperNode()
    finally:
        rclpy.shutdown()


def test_bad_clouds_are_counted(running):
    robot, mapper, until = running
    drive(running, 100, [np.eye(4)] * 2, [np.eye(4)] * 2)
    robot.send_unstamped()  # TF would take its stamp for the latest odometry
    until(lambda: mapper.clouds.drops['malformed cloud'] == 1)
    robot.send_malformed(101.5)
    until(lambda: mapper.clouds.drops['malformed cloud'] == 2)
    robot.send(102, np.eye(4), np.eye(4))
    robot.send_malformed(102.0)
    until(lambda: mapper.clouds.drops['malformed cloud'] >= 3)
    until(lambda: any('malformed cloud' in words for words in robot.words()))
    assert not mapper.survival.errors


def turn_back_time(running, seconds):
    """Send a cloud of an earlier time, after a pose that a person set."""
    robot, mapper, until = running
    given = messages.estimate_message(planar(1.0, 1.0, 1.0), np.eye(6), START_NS, 'map')
    robot.given.publish(given)
    until(lambda: mapper._given is not None)
    before = mapper._mapper
    # The first cloud of the new time may come before the transform that shows it: it is dropped.
    robot.send(seconds, np.eye(4), np.eye(4))
    until(lambda: mapper._mapper is not before)
    assert mapper._given is None


@pytest.mark.parametrize('running', [['-p', 'mapper:use_sim_time:=true']], indirect=True)
def test_a_bag_that_begins_again_begins_a_new_map(running):
    _, mapper, _ = running
    poses = [planar(0.4 * k, 0.0, 0.0) for k in range(8)]
    drive(running, 100, poses, poses)
    assert len(mapper._mapper.mapper.map.keyframes) > 2
    turn_back_time(running, 5)
    drive(running, 6, [np.eye(4)] * 2, [np.eye(4)] * 2)
    assert len(mapper._mapper.mapper.map.keyframes) == 1
    assert not mapper.survival.errors


@pytest.mark.parametrize('running', [['-p', 'mapper:use_sim_time:=true']], indirect=True)
def test_a_bag_begins_again_but_its_map_is_gone(running, tmp_path, capfd):
    _, mapper, _ = running
    poses = [planar(0.4 * k, 0.0, 0.0) for k in range(8)]
    drive(running, 100, poses, poses)
    keyframes = len(mapper._mapper.mapper.map.keyframes)
    mapper.config = replace(mapper.config, map_folder=f'{tmp_path}/gone')
    turn_back_time(running, 5)
    assert len(mapper._mapper.mapper.map.keyframes) == keyframes
    logged = capfd.readouterr().err
    assert "the map does not begin anew: 'map_folder' must be a saved map" in logged
    assert not mapper.survival.errors


def test_the_map_stays_if_a_clock_is_set_back(running, tmp_path):
    robot, mapper, until = running
    poses = [planar(0.4 * k, 0.0, 0.0) for k in range(8)]
    drive(running, 100, poses, poses)
    keyframes = len(mapper._mapper.mapper.map.keyframes)
    turn_back_time(running, 50)
    turn_back_time(running, 5)
    assert call(robot, until, 'save_map', tmp_path / 'map').success
    true, odometry = planar(0.5, 0.3, 0.2), planar(3.0, 3.0, 1.0)
    assert not drive(running, 6, [true] * 6, [odometry] * 6)[-1].lost
    np.testing.assert_allclose(place_of(robot.heard['pose'][-1]), true, atol=0.03)
    assert len(mapper._mapper.mapper.map.keyframes) >= keyframes
    assert not mapper.survival.errors


def test_that_a_robot_is_lost_and_found_is_logged_and_meanwhile_there_is_no_pose(running, capfd):
    robot, _, _ = running
    carried = [planar(-2.0, -1.0, 2.5)] * 12
    found = drive(running, 0, [np.eye(4)] * FIRST + carried, [np.eye(4)] * (FIRST + 12))
    assert found[FIRST].lost
    assert not found[-1].lost
    heard = [seconds_of(time_ns(message.header.stamp)) for message in robot.heard['pose']]
    assert heard == [k for k, estimate in enumerate(found) if not estimate.lost]
    logged = capfd.readouterr().err
    assert logged.count('the robot is lost') == 1
    assert logged.count('the robot is found in the map') == 2
    assert f'the robot is lost: {found[FIRST].lost}' in logged


def test_a_mapper_without_odometry_is_an_error(running):
    robot, _, until = running
    robot.send_cloud(0, np.eye(4))

    def levels():
        return [state.level for state in robot.reports() if 'no odometry' in state.message]

    until(levels)
    assert levels()[-1] == DiagnosticStatus.ERROR


def unused(robot):
    return [each for each in robot.reports() if 'no cloud was used for' in each.message]


def send_in_odom(robot):
    robot.send_cloud(2.0, np.eye(4), 'odom')


def send_without_odometry(robot):
    robot.send_cloud(50.0, np.eye(4))


def send_malformed(robot):
    robot.send_malformed(1.0)  # two of them


@pytest.mark.parametrize('send', [send_in_odom, send_without_odometry, send_malformed])
def test_that_all_clouds_are_dropped_is_an_error_until_one_is_used(running, send, monkeypatch):
    robot, mapper, until = running
    match(running, 0, np.eye(4), np.eye(4))
    monkeypatch.setattr(diagnosis, 'UNUSED', 0.0)
    for count in (1, 2):
        send(robot)
        until(lambda count=count: mapper.clouds.drops.total() >= count)
    until(lambda: unused(robot))
    assert unused(robot)[-1].level == DiagnosticStatus.ERROR
    match(running, 1, np.eye(4), np.eye(4))
    robot.heard['/diagnostics'].clear()
    until(robot.reports)
    assert not unused(robot)
    assert robot.reports()[-1].level < DiagnosticStatus.ERROR


def test_single_clouds_that_are_dropped_are_no_error(running, monkeypatch):
    robot, mapper, until = running
    monkeypatch.setattr(diagnosis, 'UNUSED', 0.0)
    for k in range(3):
        send_in_odom(robot)
        until(lambda count=k + 1: mapper.clouds.drops.total() == count)
        match(running, k, np.eye(4), np.eye(4))
    send_in_odom(robot)
    until(lambda: mapper.clouds.drops.total() == 4)
    robot.heard['/diagnostics'].clear()
    until(robot.reports)
    assert not unused(robot)


def test_a_second_publisher_of_clouds_is_named(running):
    robot, _, until = running
    other = robot.create_publisher(PointCloud2, 'points', 10)
    until(
        lambda: any(
            '2 publishers of /points: stop all but one' in words for words in robot.words()
        )
    )
    robot.destroy_publisher(other)


def test_clouds_of_a_second_publisher_do_not_count_as_long_as_the_first_one_sends(
    running, monkeypatch
):
    robot, mapper, until = running
    other = robot.create_publisher(PointCloud2, 'points', 10)
    until(other.get_subscription_count)
    aside, steps = planar(0.0, 0.0, 0.4), range(0, 60, 10)  # s, of stamps: none is silent
    for count, seconds in enumerate(steps):
        estimate = match(running, seconds, np.eye(4), np.eye(4))
        assert not estimate.lost or count == 0
        np.testing.assert_allclose(estimate.pose, np.eye(4), atol=0.02)
        if count > 1:  # DDS has only numbers, which would be the same
            robot.send_cloud(seconds, aside, publisher=other)
            until(lambda count=count: mapper.clouds.drops[OF_OTHERS] == count - 1)
    assert mapper.clouds.drops.total() == len(steps) - 2
    until(lambda: any(OF_OTHERS in words for words in robot.words()))
    later = cloud_input.steady_ns() + 100 * 10**9  # the first one is silent meanwhile
    monkeypatch.setattr(cloud_input, 'steady_ns', lambda: later)
    robot.send_odometry(70, np.eye(4))
    robot.send_cloud(70, aside, publisher=other)
    until(lambda: seconds_of(mapper.output.snapshot.estimate.stamp_ns) == 70)
    robot.destroy_publisher(other)


def test_clouds_of_a_publisher_that_began_anew_count_at_once(running):
    robot, mapper, until = running
    for seconds in (0, 10, 20):  # of stamps: a pause of 40 s would be usual
        match(running, seconds, np.eye(4), np.eye(4))
    robot.destroy_publisher(robot._clouds)
    until(lambda: not mapper.count_publishers('points'))
    robot._clouds = robot.create_publisher(PointCloud2, 'points', 10)
    until(lambda: robot._clouds.get_subscription_count() and mapper.count_publishers('points'))
    match(running, 30, np.eye(4), np.eye(4))
    assert not mapper.clouds.drops


def test_a_folder_of_nobody_is_refused(running):
    robot, _, until = running
    answer = call(robot, until, 'load_map', '~nobody_of_this_name/map')
    assert not answer.success
    assert answer.message.startswith("'folder' must be in a home directory")


def test_an_unexpected_error_of_a_request_is_answered_and_logged(running, capfd, monkeypatch):
    robot, _, until = running
    monkeypatch.setattr('nodlidar_mapper.ros.map_output.load', lambda folder: 1 // 0)
    answer = call(robot, until, 'load_map', 'anywhere')
    assert not answer.success
    assert answer.message.startswith('internal error, ZeroDivisionError')
    assert 'ZeroDivisionError' in capfd.readouterr().err
    assert 'no cloud was matched' in call(robot, until, 'save_map', 'anywhere').message


def test_clouds_without_odometry_are_counted_as_such_however_fast_they_come(running, capfd):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    for k in range(4):
        robot.send_cloud(50.0 + 0.1 * k, np.eye(4))
    until(lambda: mapper.clouds.drops.total() == 4)
    assert mapper.clouds.drops[NO_ODOMETRY] == 4
    assert f'{NO_ODOMETRY}; stamped +49.0 s after the newest odometry' in capfd.readouterr().err


def test_without_any_odometry_no_stamp_is_compared_with_it(running, capfd):
    robot, mapper, until = running
    robot.send_cloud(0, np.eye(4))
    until(lambda: mapper.clouds.drops == {NO_ODOMETRY: 1})
    assert f'{NO_ODOMETRY}; there was no odometry so far' in capfd.readouterr().err


def test_clouds_that_are_lost_while_the_mapper_stands_still_are_counted(running):
    robot, mapper, until = running
    robot.send_cloud(0, np.eye(4))
    until(lambda: mapper.clouds.received == 1)
    for k in range(8):  # nothing is taken meanwhile, and only some of them wait
        robot.send_cloud(0.1 + 0.1 * k, np.eye(4))
    until(lambda: mapper.clouds.received + mapper.clouds.drops[LOST] == 9)
    assert mapper.clouds.drops[LOST] > 0


def test_the_frame_of_a_cloud_that_tf_does_not_have_is_named(running):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    robot.send(2.0, np.eye(4), np.eye(4), frame='lidar_of_nobody')
    until(lambda: mapper.clouds.drops.total() == 1)
    assert [*mapper.clouds.drops] == [
        "cloud in a frame without transform to 'base_link': 'lidar_of_nobody'"
    ]


def test_of_frames_that_a_publisher_invents_only_some_are_named(running):
    _, mapper, _ = running
    reasons = [mapper.clouds._unplaced(f'frame_{k % 15}') for k in range(45)]
    assert len(set(reasons)) == MOST_FRAMES + 1
    assert reasons[0].endswith(": 'frame_0'")
    assert reasons[14] == reasons[44]
    assert reasons[14].endswith(': others')


def test_in_a_pause_of_odometry_nobody_knows_where_a_cloud_was_taken(running):
    """The robot goes out and back meanwhile, so that TF would have it at rest all the time."""
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    robot.send_odometry(5.0, np.eye(4))
    robot.send_cloud(3.0, planar(0.5, 0.0, 0.6))
    until(lambda: mapper.clouds.drops == {NO_ODOMETRY: 1})
    match(running, 5.0, np.eye(4), np.eye(4))


def test_a_place_that_nothing_shows_after_a_silence_of_odometry_is_told(running, capfd):
    robot, mapper, until = running
    for k in range(8):
        pose = planar(0.1 * k, 0.0, 0.0)
        match(running, 0.5 * k, pose, pose)
    away = planar(20.0, 0.0, 0.0)
    robot.send_odometry(20.0, away)  # 2 m/s may be
    robot.send(20.0, np.eye(4), away)
    until(lambda: mapper.output.snapshot.estimate.uncertainty > 10.0)
    until(lambda: any('is uncertain by' in words for words in robot.words()))
    assert 'the place in the map is uncertain by' in capfd.readouterr().err


# No cloud may wait in vain, however slow the host is.
@pytest.mark.parametrize('running', [['-p', 'odometry_deadline:=10.0']], indirect=True)
def test_of_the_clouds_that_wait_for_odometry_the_newest_ones_are_matched(running):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 2, [np.eye(4)] * 2)
    count = MOST_READY + 2
    for k in range(count):
        robot.send_cloud(1.05 + 0.07 * k, np.eye(4))
    until(lambda: mapper.clouds.received == 2 + count)
    robot.send_odometry(1.05 + 0.07 * count, np.eye(4))
    last = round(1.05 + 0.07 * (count - 1), 6)
    until(lambda: seconds_of(mapper.output.snapshot.estimate.stamp_ns) == last)
    assert mapper.clouds.drops == {BUSY: 2}
    assert len(mapper.output.snapshot.path) == 2 + MOST_READY


@pytest.mark.parametrize('running', [['-p', 'odometry_delay:=-1.0']], indirect=True)
def test_there_is_no_odometry_before_time_begins(running):
    assert running[1].clouds.odometry_of('base_link', 500_000_000) is None


def test_a_map_that_stays_as_it_is_is_not_drawn_again(running, monkeypatch):
    robot, mapper, until = running
    monkeypatch.setattr(map_output, 'SHARE', 1.0)  # however long drawing takes on a busy host
    mapper.output._config = replace(mapper.output._config, map_period=0.5)
    drive(running, 0, [np.eye(4)] * FIRST, [np.eye(4)] * FIRST)  # these are mapped again

    def latest(topic):
        return time_ns(robot.heard[topic][-1].header.stamp) if robot.heard[topic] else 0

    until(lambda: latest('path') == latest('map') == START_NS + (FIRST - 1) * 10**9)
    drawn = len(robot.heard['map'])
    drive(running, 10, [np.eye(4)] * 4, [np.eye(4)] * 4)
    until(lambda: latest('path') == START_NS + 13 * 10**9)
    assert len(robot.heard['map']) == drawn
    poses = [planar(0.4 * k, 0.0, 0.0) for k in range(8)]
    drive(running, 14, poses, poses)
    until(lambda: len(robot.heard['map']) > drawn)


def test_a_map_that_could_not_be_drawn_is_drawn_later(running, monkeypatch):
    robot, mapper, until = running
    mapper.output._config = replace(mapper.output._config, map_period=0.5)
    whole, calls = map_output.surface_and_grid, []

    def fails_once(*given):
        calls.append(given)
        if len(calls) == 1:
            raise ArithmeticError
        return whole(*given)

    monkeypatch.setattr(map_output, 'surface_and_grid', fails_once)
    drive(running, 0, [np.eye(4)] * FIRST, [np.eye(4)] * FIRST)
    until(lambda: robot.heard['map'])
    assert len(calls) > 1


def test_a_map_that_is_drawn_while_another_one_begins_is_not_published(running, monkeypatch):
    robot, mapper, until = running
    whole, begun, go_on = map_output.surface_and_grid, threading.Event(), threading.Event()

    def held(*given):
        begun.set()
        assert go_on.wait(LONGEST)
        return whole(*given)

    monkeypatch.setattr(map_output, 'surface_and_grid', held)
    drive(running, 0, [np.eye(4)], [np.eye(4)])
    until(begun.is_set)
    mapper._continue_with(mapper._first_mapper())
    drive(running, 20, [np.eye(4)], [np.eye(4)])
    go_on.set()
    until(lambda: robot.heard['map'])
    assert seconds_of(time_ns(robot.heard['map'][0].header.stamp)) == 20


def test_clouds_in_the_frame_of_odometry_are_dropped_and_the_remedy_is_named(running):
    robot, mapper, until = running
    robot.send(0, np.eye(4), np.eye(4), frame='odom')
    until(lambda: sum(mapper.clouds.drops.values()) == 1)
    until(lambda: any('ego_motion: deskew' in words for words in robot.words()))
    assert mapper.clouds.next() is None


@pytest.mark.parametrize('running', [['-p', 'odometry_delay:=0.5']], indirect=True)
def test_odometry_that_is_stamped_late_counts_from_its_measurement(running):
    """Otherwise it would be that of half a second before, half a step of this drive."""
    robot, mapper, until = running
    robot.late_ns = 500_000_000
    poses = [planar(0.3 * k, 0.0, 0.1 * k) for k in range(5)]
    drive(running, 0, poses, poses)
    np.testing.assert_allclose(place_of(robot.heard['pose'][-1]), poses[-1], atol=0.03)
    until(lambda: robot.transforms.can_transform('map', 'odom', Time()))
    found = messages.matrix_of(robot.transforms.lookup_transform('map', 'odom', Time()))
    np.testing.assert_allclose(found, np.eye(4), atol=0.03)
    given = planar(1.0, 0.5, 0.2)
    robot.given.publish(messages.estimate_message(given, np.eye(6), START_NS, 'map'))
    until(lambda: mapper._given is not None)
    np.testing.assert_allclose(mapper._given[0] @ poses[-1], given, atol=1e-9)


def test_the_robot_is_where_a_person_sets_it(running):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 3, [np.eye(4)] * 3)
    true = planar(1.5, 0.5, 0.4)
    given = messages.estimate_message(
        true @ planar(0.1, -0.1, 0.05), np.diag([0.04] * 6), START_NS, 'map'
    )
    robot.given.publish(given)
    until(lambda: mapper._given is not None)
    drive(running, 3, [true] * 2, [np.eye(4)] * 2)
    np.testing.assert_allclose(place_of(robot.heard['pose'][-1]), true, atol=0.03)
    given.header.frame_id = 'odom'
    given.header.stamp = time_message(START_NS)
    robot.given.publish(given)
    robot.send(6, true, np.eye(4))
    until(lambda: robot.heard['pose'][-1].header.stamp.sec == START_NS // 10**9 + 6)
    assert mapper._given is None


@pytest.mark.parametrize(
    ('running', 'height', 'tilt'),
    [
        (['-p', 'freedom:=planar'], 0.3, 0.1),
        (['-p', 'freedom:=spatial'], 0.0, 0.0),
    ],
    indirect=['running'],
)
def test_height_and_tilt_are_those_of_odometry_if_planar(running, height, tilt):
    robot, mapper, until = running
    odometry = planar(1.0, 2.0, 0.5)
    odometry[:3, :3] = Rotation.from_euler('ZYX', [0.5, 0.1, 0.0]).as_matrix()
    odometry[2, 3] = 0.3
    drive(running, 0, [np.eye(4)] * 2, [odometry] * 2)
    given = messages.estimate_message(planar(1.5, 0.5, 2.0), np.eye(6), START_NS, 'map')
    robot.given.publish(given)
    until(lambda: mapper._given is not None)
    pose = mapper._given[0] @ odometry
    yaw, pitch, roll = Rotation.from_matrix(pose[:3, :3]).as_euler('ZYX')
    np.testing.assert_allclose(pose[:3, 3], [1.5, 0.5, height], atol=1e-9)
    np.testing.assert_allclose([yaw, pitch, roll], [2.0, tilt, 0.0], atol=1e-9)


TWO = ['-p', "cloud_topics:=['points', 'other/points']"]


@pytest.mark.parametrize('running', [TWO], indirect=True)
def test_a_topic_without_any_cloud_is_named_when_there_are_others(running):
    robot, _, until = running
    until(robot.words)
    robot.send_two(True, False)
    until(lambda: any('no cloud on /other/points yet' in words for words in robot.words()))
    assert not any('no cloud on /points yet' in words for words in robot.words())
    robot.heard['/diagnostics'].clear()
    robot.send_two(False, True)
    until(lambda: robot.words() and 'yet' not in robot.words()[-1].replace('matched yet', ''))


@pytest.mark.parametrize('running', [TWO], indirect=True)
def test_a_sensor_that_is_silent_is_told_apart_from_the_other(running):
    """Clouds of both come together every 0.6 s, as of two nods in phase."""
    robot, mapper, until = running
    until(lambda: mapper.count_publishers('other/points'))

    def send(first, second, until_told):
        last = [time.monotonic() - 0.6]

        def told():
            if time.monotonic() - last[0] > 0.6:
                last[0] = time.monotonic()
                robot.send_two(first, second)
            return until_told()

        until(told)

    send(True, True, lambda: mapper.clouds.received >= 10)
    assert not any('no cloud on' in words for words in robot.words())
    send(True, False, lambda: any('no cloud on' in words for words in robot.words()))
    assert not any('no cloud on /points' in words for words in robot.words())
    assert any('no cloud on /other/points for' in words for words in robot.words())


def test_a_cloud_without_a_stamp_hides_no_silence(running):
    robot, mapper, until = running
    robot.send_unstamped()
    until(lambda: mapper.clouds.received == 1)
    for count in (2, 3):
        robot.send_two(True, False)
        until(lambda count=count: mapper.clouds.received == count)
    [silence] = mapper.clouds.silences.values()
    assert silence.seconds(cloud_input.steady_ns() + 3600 * 10**9) > 3000.0


@pytest.mark.parametrize('running', [TWO], indirect=True)
def test_clouds_far_behind_those_of_the_other_sensor_are_dropped_and_counted(running):
    robot, mapper, until = running
    drive(running, 0, [np.eye(4)] * 6, [np.eye(4)] * 6)
    until(lambda: mapper.count_publishers('other/points'))
    robot.send_cloud(2.0, np.eye(4), publisher=robot.others)
    until(lambda: mapper.clouds.drops[BEHIND] == 1)
    robot.send_cloud(3.0, np.eye(4), publisher=robot.others)
    until(lambda: seconds_of(mapper.output.snapshot.estimate.stamp_ns) == 3.0)
    match(running, 6, np.eye(4), np.eye(4))  # and none of the first sensor is
    assert mapper.clouds.drops == {BEHIND: 1}


@pytest.mark.parametrize('other', ['/points', '~/points'])
def test_two_names_of_one_topic_are_refused(other):
    names = ['-p', f"cloud_topics:=['points', '{other}']", '-r', '~/points:=points']
    rclpy.init(args=['--ros-args', *names])
    try:
        with pytest.raises(ParameterError, match='all different'):
            MapperNode()
    finally:
        rclpy.shutdown()
