"""The launch file with clouds in odom: of a robot that drives, and when its odometry dies."""

from contextlib import contextmanager
import signal
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_common.stamps import time_ns
from nodlidar_sim.world.scene import load_scene
import numpy as np
from observer import Observer, START_TIMEOUT
import pytest
from sensor_msgs.msg import PointCloud2

RUN = 'import sys; from nodlidar_sim.commands.entry_points import emulate; sys.exit(emulate())'
SCAN_NS = 66_600_000  # from the first beam to the last
# Odometry comes from a process of the test.
OTHER_ODOMETRY = 'base:=route', 'ego_motion:=beam'
LATE = 'dropped: no odometry after it before the deadline'


@contextmanager
def observed(*topics):
    observer = Observer()
    for message_type, topic in topics:
        observer.subscribe(message_type, topic)
    try:
        yield observer
    finally:
        observer.close()


def way_of(odometry):
    """Return the length of the way that odometry tells [m]."""
    places = [(m.pose.pose.position.x, m.pose.pose.position.y) for m in odometry]
    return np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)) if len(places) > 1 else 0.0


@pytest.fixture
def in_the_background():
    """Ignore Ctrl-C, as what a script starts in the background does; so do its children."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures('in_the_background')
def test_clouds_of_a_robot_that_drives_lie_on_the_room(tmp_path):
    """Within 10 mm RMS, which one pose for each scan does not reach.

    The frame odom is where the base starts, which in the room is the origin of the world.
    """
    log = tmp_path / 'launch.log'
    arguments = (
        'scene:=room',
        'ideal:=true',
        'route:=figure_of_eight',
        'base:=odometry',
        'ego_motion:=beam',
    )
    with (
        observed((PointCloud2, 'points'), (Odometry, 'odom')) as observer,
        launched_sensor(log, *arguments) as running,
    ):
        clouds, odometry = observer.messages['points'], observer.messages['odom']
        enough = lambda: len(clouds) >= 30 and way_of(odometry) > 1.0  # noqa: E731
        observer.spin_until(lambda: enough() or not running.running(), 'clouds on the way')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    for cloud in clouds:
        assert cloud.header.frame_id == 'odom'
        assert [field.name for field in cloud.fields] == ['x', 'y', 'z', 'intensity', 'ring']
    points = np.concatenate([coordinates(cloud) for cloud in clouds])
    assert len(points) > 15_000
    distance = load_scene('room', ideal=True).surfaces.surface_distance(points)
    assert np.sqrt(np.mean(distance**2)) < 0.01


@contextmanager
def odometry_process(tmp_path):
    """Run odometry of a robot that stands, in a process of its own."""
    link = ['--servo-link', str(tmp_path / 'no_servo'), '--scene', 'wall', '--base', 'odometry']
    process = subprocess.Popen([sys.executable, '-c', RUN, *link], stdout=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(START_TIMEOUT)


def drops(diagnostics, reason):
    """Return how often the assembler says it dropped a scan for a reason, and its last level."""
    told = [s for array in diagnostics for s in array.status if s.name == 'assembler: clouds']
    counts = [int(v.value) for v in told[-1].values if v.key == reason] if told else []
    return (counts[0] if counts else 0), (told[-1].level if told else None)


def test_when_odometry_dies_scans_are_dropped_and_counted_until_it_lives_again(tmp_path):
    log = tmp_path / 'launch.log'
    topics = (PointCloud2, 'points'), (Odometry, 'odom'), (DiagnosticArray, '/diagnostics')
    with (
        observed(*topics) as observer,
        launched_sensor(log, 'scene:=wall', 'ideal:=true', *OTHER_ODOMETRY) as running,
    ):
        clouds, odometry, diagnostics = map(observer.messages.get, [t for _, t in topics])
        with odometry_process(tmp_path) as process:
            observer.spin_until(lambda: len(clouds) >= 10 and odometry, 'clouds with odometry')
            process.kill()
            process.wait()
            before, _ = drops(diagnostics, LATE)
            dropped = lambda: drops(diagnostics, LATE)  # noqa: E731
            observer.spin_until(lambda: dropped()[0] >= before + 5, 'five dropped scans')
            observer.spin_until(lambda: dropped()[1] == b'\x02', 'an error: no odometry')
        last_ns = time_ns(odometry[-1].header.stamp)
        # A cloud may miss up to its first and last beams: half a scan is sure to be in it.
        assert all(time_ns(cloud.header.stamp) + SCAN_NS / 2 < last_ns for cloud in clouds)
        assert all(cloud.header.frame_id == 'odom' for cloud in clouds)
        killed = len(clouds)
        with odometry_process(tmp_path):
            observer.spin_until(lambda: len(clouds) >= killed + 5, 'clouds with new odometry')
        assert running.interrupt() == 0, log.read_text()
