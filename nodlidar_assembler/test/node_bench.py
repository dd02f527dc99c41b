"""The assembler node on real DDS, what feeds and hears it, and the log of a simulated sensor."""

from contextlib import contextmanager
import time

from diagnostic_msgs.msg import DiagnosticArray
from log_messages import scan_message, state_message
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_common.nod import Nod
from nodlidar_common.ros.executor import Executor
from nodlidar_msgs.msg import Coverage, NodCommand
from nodlidar_sim.simulation import simulate
import numpy as np
import rclpy
from sensor_msgs.msg import JointState, LaserScan, PointCloud2

START_NS = 1_700_000_000_000_000_000
BEAM_PERIOD = 0.1 / 1024
LONGEST = 30.0
SCAN_NS = 66_600_000  # a scan comes after its last beam


def simulated(scene, duration):
    """Return what the fast mode makes of a scene."""
    nod = Nod(-0.6136, 0.6136, 4001 * BEAM_PERIOD, 4001, START_NS)
    return simulate(scene, nod, duration, start_ns=START_NS)


def sensor_log(sensor, odometry=None):
    """Return what the reference sensor publishes, rounded as in messages."""
    geometry = ScanGeometry(
        682, np.float32(sensor.azimuth[0]), np.float32(2 * np.pi / 1024), np.float32(BEAM_PERIOD),
        np.float32(0.02), np.float32(5.6),
    )  # fmt: skip
    scans = [
        Scan(int(stamp_ns), geometry, ranges.astype(np.float32))
        for stamp_ns, ranges in zip(sensor.scan_stamp_ns, sensor.ranges, strict=True)
    ]
    return SensorLog(scans, sensor.joint_stamp_ns, sensor.joint_position, odometry)


class NodeBench:
    """An assembler node, a feeder and what came out."""

    def __init__(self, parameters):
        rclpy.init(args=['--ros-args', *(f for p in parameters for f in ('-p', p))])
        self.node, self.feeder = AssemblerNode(), rclpy.create_node('feeder')
        self.executor = Executor()
        for node in (self.node, self.feeder):
            self.executor.add_node(node)
        self.out = {PointCloud2: [], NodCommand: [], DiagnosticArray: [], Coverage: []}
        topics = ('points', 'nod_command', '/diagnostics', 'assembler/coverage')
        for kind, topic in zip(self.out, topics, strict=True):
            self.feeder.create_subscription(kind, topic, self.out[kind].append, 50)
        self.scans = self.feeder.create_publisher(LaserScan, 'scan', 10)
        self.states = self.feeder.create_publisher(JointState, 'joint_states', 50)
        topics = [p for p in self.node.publishers if p.topic_name in ('/points', '/nod_command')]
        self.spin_until_heard(self.scans, self.states, *topics)

    def spin_until(self, condition):
        deadline = time.monotonic() + LONGEST
        while not condition():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.05)

    def spin_until_heard(self, *publishers):
        self.spin_until(lambda: all(p.get_subscription_count() for p in publishers))

    def send(self, publisher, message):
        """Publish a message, and let the node keep up.

        It takes joint states when a scan waits for them, so they wake nobody.
        """
        publisher.publish(message)
        self.executor.spin_once(timeout_sec=0.0 if publisher is self.states else 0.05)

    def feed(self, log, others=()):
        """Send a log and others, of (time, publisher, message)."""
        messages = [
            (scan.stamp_ns + SCAN_NS, self.scans, scan_message(scan)) for scan in log.scans
        ]
        messages += [
            (stamp_ns, self.states, state_message(stamp_ns, pitch))
            for stamp_ns, pitch in zip(log.sample_ns, log.sample_pitch, strict=True)
        ]
        for _, publisher, message in sorted([*messages, *others], key=lambda entry: entry[0]):
            self.send(publisher, message)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.feeder.destroy_node()
        rclpy.shutdown()


@contextmanager
def bench(*parameters, kind=NodeBench):
    made = kind(parameters)
    try:
        yield made
    finally:
        made.close()
