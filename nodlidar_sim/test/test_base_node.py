"""The base's node on real DDS, with a clock that the test turns."""

import math
import time

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from nodlidar_common.ros.executor import Executor
from nodlidar_common.stamps import time_ns
from nodlidar_sim.ports.virtual_port import VirtualClock
from nodlidar_sim.ros.base_node import BaseNode
from nodlidar_sim.world.commanded import CommandedBase
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.odometry import Odometer
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.route import Plan
import numpy as np
import pytest
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import TimeReference
from tf2_msgs.msg import TFMessage

S = 1_000_000_000
START_NS = 1_700_000_000 * S
LONGEST = 30.0
EXACT = Effects()


class Bench:
    """A base's node, someone who listens to it and drives it."""

    def __init__(self, base, commanded=None, effects=EXACT):
        rclpy.init()
        self.clock, self.running = VirtualClock(START_NS), True
        odometer, uncertainty = Odometer(base, effects, START_NS), OdometryUncertainty(effects)
        self.node = BaseNode(odometer, uncertainty, self.clock, lambda: self.running, commanded)
        self.other = rclpy.create_node('other')
        self.executor = Executor()
        for node in (self.node, self.other):
            self.executor.add_node(node)
        self.odometry, self.transforms = [], []
        self.other.create_subscription(Odometry, 'odom', self.odometry.append, 50)
        self.other.create_subscription(TFMessage, '/tf', self.transforms.append, 50)
        self.commands = self.other.create_publisher(Twist, 'cmd_vel', 10)
        heard = [p for p in self.node.publishers if p.topic in ('/odom', '/tf')]
        self.spin_until(lambda: all(p.get_subscription_count() for p in heard))

    def spin_until(self, condition):
        deadline = time.monotonic() + LONGEST
        while not condition():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.05)

    def at(self, seconds):
        """Return the odometry and the transform of an instant after the start."""
        self.clock.advance_to(START_NS + round(seconds * S))
        stamped = lambda stamp: time_ns(stamp) == self.clock()  # noqa: E731
        self.spin_until(lambda: self.odometry and stamped(self.odometry[-1].header.stamp))
        latest = lambda: self.transforms and self.transforms[-1].transforms[0]  # noqa: E731
        self.spin_until(lambda: latest() and stamped(latest().header.stamp))
        return self.odometry[-1], latest()

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.other.destroy_node()
        rclpy.shutdown()


@pytest.fixture
def bench():
    benches = []

    def make(*arguments):
        benches.append(Bench(*arguments))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def test_odometry_and_transform_follow_the_route_from_its_start(bench):
    """A quarter of a circle of 2 m radius, at 0.5 m/s; odom is where it began."""
    route = Plan((0.5, 0.25)).route((3.0, -1.0, 0.7), START_NS)
    odometry, stamped = bench(route).at(2.0 * math.pi)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ('odom', 'base_link')
    place, twist = odometry.pose.pose, odometry.twist.twist
    assert (place.position.x, place.position.y) == pytest.approx((2.0, 2.0))
    half = math.sqrt(0.5)
    turned = math.sin(math.pi / 4), math.cos(math.pi / 4)
    assert turned == pytest.approx((half, half))
    assert (place.orientation.z, place.orientation.w) == pytest.approx(turned)
    assert (twist.linear.x, twist.angular.z) == pytest.approx((0.5, 0.25))
    assert (stamped.header.frame_id, stamped.child_frame_id) == ('odom', 'base_link')
    assert stamped.transform.translation.x == place.position.x
    assert stamped.transform.translation.y == place.position.y
    assert stamped.transform.rotation == place.orientation


def test_who_comes_late_learns_when_the_base_left_its_start(bench):
    running, starts = bench(Plan((0.5, 0.0)).route((0.0, 0.0, 0.0), START_NS)), []
    running.clock.advance_to(START_NS + 5 * S)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    running.other.create_subscription(TimeReference, 'base/start', starts.append, latched)
    running.spin_until(lambda: starts)
    [start] = starts
    assert (time_ns(start.header.stamp), time_ns(start.time_ref)) == (START_NS, 0)


def test_covariances_grow_with_the_way_and_mark_what_wheels_do_not_measure(bench):
    """Straight on: 2 % of each wheel's way, 2 % sqrt 2 / 0.4 m of heading each metre."""
    effects = Effects(odometry_error=0.02)
    running = bench(Plan((0.5, 0.0)).route((3.0, -1.0, 0.7), START_NS), None, effects)
    for seconds in (2.0, 4.0):
        odometry, _ = running.at(seconds)
        way = 0.5 * seconds
        pose = np.reshape(odometry.pose.covariance, (6, 6))
        along, heading = way * 0.02 / math.sqrt(2), way * 0.02 * math.sqrt(2) / 0.4
        # The wheels that they are made of are known as they counted, by 2 % off themselves.
        assert np.sqrt(np.diag(pose)[[0, 5]]) == pytest.approx([along, heading], rel=0.1)
        assert np.diag(pose)[1] > np.diag(pose)[0]
        assert np.all(np.diag(pose)[2:5] == 1e6)
        twist = np.reshape(odometry.twist.covariance, (6, 6))
        assert np.sqrt(twist[0, 0]) == pytest.approx(0.5 * 0.02 / math.sqrt(2), rel=0.1)
        assert twist[1, 1] == 0.0
        for covariance in (pose, twist):
            np.testing.assert_allclose(covariance, covariance.T, rtol=1e-12, atol=1e-15)
            assert np.all(np.linalg.eigvalsh(covariance) > -1e-9)


def test_cmd_vel_drives_the_base_until_its_timeout(bench):
    base = CommandedBase((0.0, 0.0, 0.0), START_NS, 0.5)
    bench = bench(base, base)
    assert bench.at(1.0)[0].pose.pose.position.x == 0.0
    command = Twist()
    command.linear.x = math.nan
    bench.spin_until(lambda: bench.commands.get_subscription_count())
    bench.commands.publish(command)
    command.linear.x = 0.4
    bench.commands.publish(command)
    bench.spin_until(lambda: not base._route.stands)
    odometry, _ = bench.at(1.25)
    assert odometry.pose.pose.position.x == pytest.approx(0.1)
    assert odometry.twist.twist.linear.x == pytest.approx(0.4)
    odometry, _ = bench.at(5.0)
    assert odometry.pose.pose.position.x == pytest.approx(0.2)


def test_the_node_fails_when_the_simulation_ends(bench):
    bench = bench(Plan().route((0.0, 0.0, 0.0), START_NS))
    bench.running = False
    bench.spin_until(lambda: bench.node.failed)


def test_what_odometry_counted_before_the_node_is_as_uncertain_as_what_comes_later():
    """The errors since the start of the simulation are in the first pose already."""
    effects, base = (
        Effects(odometry_error=0.02, heading_drift=0.005),
        Plan((0.6, 0.0)).route((0.0, 0.0, 0.0), START_NS),
    )
    deviations = []
    rclpy.init()
    for late_ns in (0, 2 * 10**9):
        clock, uncertainty = VirtualClock(START_NS + late_ns), OdometryUncertainty(effects)
        node = BaseNode(Odometer(base, effects, START_NS), uncertainty, clock)
        while clock() < START_NS + 4 * 10**9:
            clock.advance_to(clock() + 20_000_000)
            node.sample()
        deviations.append(np.sqrt(np.diag(uncertainty.of_pose)))
        node.destroy_node()
    rclpy.shutdown()
    assert deviations[1] == pytest.approx(deviations[0], rel=0.1)
