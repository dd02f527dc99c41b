"""Three robots in one domain, each with a namespace and transforms of its own."""

from contextlib import contextmanager
import time

from geometry_msgs.msg import TransformStamped
from log_messages import scan_message, state_message
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.point_cloud import coordinates
import numpy as np
import rclpy
from rclpy import utilities
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from tf2_msgs.msg import TFMessage

START_NS, MS = 1_700_000_000_000_000_000, 1_000_000
OWN_TF = ('-r', '/tf:=tf', '-r', '/tf_static:=tf_static')
LEVER = 0.080  # of the optical centre over the nod axis [m]
ROBOTS = {'/robot1': 1.0, '/robot2': 2.0, '/robot3': 3.0}  # each in a sphere of this radius [m]
APART = 100.0  # between the places of the robots in their frames odom [m]
LONGEST, SCANS = 30.0, 6


class Robot:
    """An assembler of one robot, and what feeds and hears it."""

    def __init__(self, namespace, radius):
        self.radius, self.clouds = radius, []
        self.x = APART * radius
        context = rclpy.Context()
        # The longest deadline: a busy host may hand on odometry late.
        parameters = ['-p', 'ego_motion:=beam', '-p', 'deadline:=10.0']
        arguments = ['-r', f'__ns:={namespace}', *OWN_TF, *parameters]
        rclpy.init(args=['--ros-args', *arguments], context=context)
        utilities.g_default_context = context  # that of the nodes which are made next
        self.node, self.feeder = AssemblerNode(), rclpy.create_node('feeder')
        self.executor = Executor(context=context)
        for node in (self.node, self.feeder):
            self.executor.add_node(node)
        self.scans = self.feeder.create_publisher(LaserScan, 'scan', 10)
        self.states = self.feeder.create_publisher(JointState, 'joint_states', 50)
        self.tf = self.feeder.create_publisher(TFMessage, '/tf', 50)
        self.feeder.create_subscription(PointCloud2, 'points', self.clouds.append, 50)

    def transform(self, at_ns):
        message = TransformStamped(child_frame_id='nodlidar_base_link')
        message.header.frame_id, message.header.stamp = 'odom', time_message(at_ns)
        message.transform.translation.x = self.x
        message.transform.rotation.w = 1.0
        return message

    def feed(self, number):
        """Publish scan number n, and joint states and odometry around it."""
        at_ns = START_NS + number * 100 * MS
        for later in range(0, 100, 10):
            self.states.publish(state_message(at_ns + later * MS, 0.0))
            self.tf.publish(TFMessage(transforms=[self.transform(at_ns + later * MS)]))
        if number:
            geometry = ScanGeometry(683, -2.09, 2 * np.pi / 1024, 0.1 / 1024, 0.02, 5.6)
            ranges = np.full(683, self.radius, dtype=np.float32)
            self.scans.publish(scan_message(Scan(at_ns, geometry, ranges)))

    def heard(self):
        publishers = (self.scans, self.states, self.tf)
        others = [p for p in self.node.publishers if p.topic_name.endswith('/points')]
        return all(p.get_subscription_count() for p in (*publishers, *others))

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.feeder.destroy_node()
        rclpy.shutdown(context=self.node.context)


@contextmanager
def running():
    robots, before = [], utilities.g_default_context
    try:
        robots += [Robot(*each) for each in ROBOTS.items()]
        yield robots
    finally:
        for robot in robots:
            robot.close()
        utilities.g_default_context = before


def spin_until(robots, condition):
    deadline = time.monotonic() + LONGEST
    while not condition():
        assert time.monotonic() < deadline
        for robot in robots:
            robot.executor.spin_once(timeout_sec=0.002)


def own_places(robot):
    """Return how far off a sphere around the robot's own lidar each cloud's points are [m]."""
    centre = (robot.x, 0.0, LEVER)
    distances = [np.linalg.norm(coordinates(each) - centre, axis=1) for each in robot.clouds]
    return np.array([np.abs(each - robot.radius).max() for each in distances])


def test_each_robot_s_clouds_are_its_own():
    """A sphere around the optical centre, at the robot's own place in its own frame odom."""
    with running() as robots:
        spin_until(robots, lambda: all(robot.heard() for robot in robots))
        for number in range(SCANS + 1):
            for robot in robots:
                robot.feed(number)
            spin_until(robots, lambda n=number: all(len(r.clouds) >= n - 1 for r in robots))
        drops = [robot.node.assembly.assembler.drops.copy() for robot in robots]
    assert drops == [{}, {}, {}]
    for robot in robots:
        assert len(robot.clouds) >= SCANS - 1  # the last scan may wait for odometry
        assert {cloud.header.frame_id for cloud in robot.clouds} == {'odom'}
        assert own_places(robot).max() < 1e-4


def test_robots_that_share_their_transforms_disturb_each_other(monkeypatch):
    """What own_tf is for: which of three equal transforms counts is left to chance."""
    monkeypatch.setattr(f'{__name__}.OWN_TF', ())
    with running() as robots:
        spin_until(robots, lambda: all(robot.heard() for robot in robots))
        for number in range(SCANS + 1):
            for robot in robots:
                robot.feed(number)
            for _ in range(50):
                spin_until(robots, lambda: True)
                for robot in robots:
                    robot.executor.spin_once(timeout_sec=0.001)
    right = sum(int((own_places(robot) < 1e-4).sum()) for robot in robots)
    assert right < len(robots) * (SCANS - 1)
