"""The launch file with a base that drives: what the lidar sees goes with what odometry says."""

import signal

from nav_msgs.msg import Odometry
from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_common.stamps import time_ns
import numpy as np
from observer import Observer
import pytest
from rclpy.time import Time
from sensor_msgs.msg import JointState, LaserScan

FRONT = 384 - 44  # the beam that looks ahead
START, WALL = -2.5, 2.0  # of the route and of the scene [m]


def series(messages, value):
    """Return the times [ns] and a value of messages."""
    return [time_ns(m.header.stamp) for m in messages], [value(m) for m in messages]


@pytest.fixture
def in_the_background():
    """Ignore Ctrl-C, as what a script starts in the background does; so do its children."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures('in_the_background')
def test_the_wall_comes_nearer_as_odometry_says(tmp_path):
    observer = Observer()
    for kind, topic in [(Odometry, 'odom'), (LaserScan, 'scan'), (JointState, 'joint_states')]:
        observer.subscribe(kind, topic)
    log = tmp_path / 'launch.log'
    arguments = ('scene:=wall', 'ideal:=true', 'route:=approach', 'base:=odometry')
    with launched_sensor(log, *arguments) as running:
        odometry, scans, states = map(observer.messages.get, ('odom', 'scan', 'joint_states'))
        enough = lambda: len(scans) > 20 and len(states) > 200 and len(odometry) > 100  # noqa: E731
        observer.spin_until(lambda: enough() or not running.running(), 'scans and odometry')
        assert running.running(), log.read_text()
        joined = lambda: observer.transforms.can_transform('odom', 'laser', Time())  # noqa: E731
        observer.spin_until(joined, 'the transform from odom to the laser')
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    sent_ns, ranges = series(scans, lambda scan: scan.ranges[FRONT])
    sent_ns = np.array(sent_ns) + FRONT * 97656
    driven = np.interp(
        sent_ns, *series(odometry, lambda m: m.pose.pose.position.x), np.nan, np.nan
    )
    pitch = np.interp(sent_ns, *series(states, lambda m: m.position[0]), np.nan, np.nan)
    ahead = ranges * np.cos(pitch) - 0.08 * np.sin(pitch)
    errors = (ahead - (WALL - START - driven))[pitch > -0.2]  # lower ones may meet the floor
    errors = errors[np.isfinite(errors)]
    assert len(errors) >= 5
    assert np.median(np.abs(errors)) < 0.02
    assert np.nanmax(driven) > 0.3
