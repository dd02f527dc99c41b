"""The launch file with limits that follow the range, on the way toward a wall."""

import math

from nav_msgs.msg import Odometry
from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_msgs.msg import NodCommand
import numpy as np
from observer import Observer
import pytest
from sensor_msgs.msg import JointState, PointCloud2

START, WALL = -2.5, 2.0  # of the route and of the scene [m]
TOP, BOTTOM = 2.0 - 1.08, 0.1 - 1.08  # of the band, above the optical centre at pitch 0 [m]
MEDIAN = 1.0 / math.cos(math.radians(15.0))  # range in the sector, which reaches 30 degrees
FIXED = -0.6136, 0.6136
WAY = 2.5  # way [m] after which the test ends,
SETTLED_WAY = 1.1  # ... of which so much with limits that have settled, however late nodes start


@pytest.fixture(scope='module')
def drive(tmp_path_factory):
    """Return what is heard while a robot drives toward a wall, its clouds not compensated."""
    observer = Observer()
    topics = {
        Odometry: 'odom', NodCommand: 'nod_command', JointState: 'joint_states',
        PointCloud2: 'points',
    }  # fmt: skip
    for kind, topic in topics.items():
        observer.subscribe(kind, topic)
    log = tmp_path_factory.mktemp('launch') / 'launch.log'
    arguments = (
        'scene:=wall',
        'ideal:=true',
        'route:=approach',
        'base:=odometry',
        'adapt_limits:=true',
    )
    odometry, commands = observer.messages['odom'], observer.messages['nod_command']

    def driven():
        if not odometry or odometry[-1].pose.pose.position.x < WAY or not adapted(commands):
            return False
        begin_ns = settled_ns(commands)
        ways = [m.pose.pose.position.x for m in odometry if time_ns(m.header.stamp) > begin_ns]
        return bool(ways) and ways[-1] - ways[0] > SETTLED_WAY

    with launched_sensor(log, *arguments) as running:
        observer.spin_until(lambda: driven() or not running.running(), 'the way to the wall')
        assert running.running(), log.read_text()
        assert running.interrupt() == 0, log.read_text()
    observer.close()
    return {kind: observer.messages[topic] for kind, topic in topics.items()}


def adapted(commands):
    """Return the commands from the first on whose limits are not those of the mount."""
    changed = [(m.pitch_min, m.pitch_max) != pytest.approx(FIXED, abs=1e-3) for m in commands]
    return commands[changed.index(True) :] if True in changed else []


def settled_ns(commands):
    """Return when the limits follow: from those of the mount, they change at 1 rad/s."""
    return time_ns(adapted(commands)[0].header.stamp) + NS_PER_S


def stamps(messages):
    return np.array([time_ns(m.header.stamp) for m in messages])


def test_limits_are_for_where_the_robot_is_though_clouds_are_not_compensated(drive):
    """Without odometry they would be for a tenth more than the range: half a window ago."""
    commands, odometry = drive[NodCommand], drive[Odometry]
    assert {cloud.header.frame_id for cloud in drive[PointCloud2]} == {'nodlidar_base_link'}
    sent_ns, known_ns = stamps(commands), stamps(odometry)
    settled = (sent_ns > settled_ns(drive[NodCommand])) & (sent_ns > known_ns[0])
    places = [m.pose.pose.position.x for m in odometry]
    distance = (WALL - START - np.interp(sent_ns, known_ns, places))[settled] * MEDIAN
    low, high = np.array([(m.pitch_min, m.pitch_max) for m in commands]).T[:, settled]
    assert np.ptp(distance) > 1.0
    for limit, end in ((low, BOTTOM), (high, TOP)):
        off = end / np.tan(limit) / distance - 1.0
        assert np.median(np.abs(off)) < 0.05  # the hysteresis
        # With the way from command to command; a busy computer makes single ones late.
        assert np.quantile(np.abs(off), 0.9) < 0.12


def test_the_nod_follows_with_another_speed_and_stays_coprime(drive):
    commands, states = drive[NodCommand], drive[JointState]
    samples = np.array([m.samples_per_sweep for m in commands])
    assert len(set(samples)) > 1
    assert (np.gcd(samples, 1024) == 1).all()
    duration = np.array([m.sweep_duration for m in commands])
    np.testing.assert_allclose(duration, samples * 0.1 / 1024, rtol=1e-3)
    span = np.array([m.pitch_max - m.pitch_min for m in commands])
    settled = stamps(commands) > settled_ns(drive[NodCommand])
    speed = (span / duration)[settled]
    # Doubled on the whole way; a tenth on the last metre, which is all if nodes start late.
    assert speed.max() > 1.05 * speed.min()
    # Two sweeps have both turns in them, whenever the launch ends.
    at_ns = stamps(states)
    begin_ns = at_ns[-1] - 2 * duration.max() * NS_PER_S
    pitch = np.array([state.position[0] for state in states])[at_ns > begin_ns]
    asked = span[stamps(commands) > begin_ns]
    assert 0.95 * asked.min() < np.ptp(pitch) < 1.05 * asked.max()
    assert np.ptp(pitch) < 0.8 * (FIXED[1] - FIXED[0])
