"""An assembler without DDS, and messages for it: as a sensor sends them, or as none does."""

from contextlib import contextmanager
import math
import random

from geometry_msgs.msg import TransformStamped
from nodlidar_assembler.ros.node import AssemblerNode
import rclpy
from rclpy.logging import LoggingSeverity
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage

BEGIN_NS, S = 1_700_000_000_000_000_000, 1_000_000_000
NUMBERS = (
    0.0, -0.0, 1e-45, 1e-44, 1e-30, 1e-9, 1e-5, 1e-3, 0.1, 1.0, -1.0, 7.0, 1e6, 1e30, 3e38, -3e38,
    math.nan, math.inf, -math.inf,
)  # fmt: skip
SECONDS = (-(2**31), -1, 0, 1, 1_699_999_999, 1_700_000_100, 2**31 - 1)
NANOSECONDS = (0, 1, 999_999_999, S, 2**31, 2**32 - 1)
NAMES = ('', 'nod_joint', 'arm', 'x' * 300, 'odom', 'nodlidar_base_link', '/odom', 'ä\n')
BEAMS = (0, 1, 2, 60, 61, 1024, 2049, 100_000)


class Messages:
    """Makes messages at random, a hundredth of a second apart.

    Parameters
    ----------
    seed
        Of the choices.
    wrong
        Share of the messages that are not as a sensor sends them.
    """

    def __init__(self, seed, wrong=0.2):
        self._random, self._wrong = random.Random(seed), wrong
        self._now_ns = BEGIN_NS

    def next(self):
        """Return which input gets a message, 'scan', 'joint' or 'tf', and the message."""
        self._now_ns += 10_000_000
        if self._random.random() < 0.001:  # a clock that is set
            self._now_ns += self._random.choice((-3600, -25, 3600)) * S
            self._now_ns = max(self._now_ns, BEGIN_NS)
        kind = self._random.choices(('scan', 'joint', 'tf'), (0.08, 0.72, 0.2))[0]
        message = getattr(self, kind)()
        while self._random.random() < self._wrong:
            getattr(self, f'spoil_{kind}')(message)
        return kind, message

    def stamped(self, message):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(self._now_ns, S)
        return message

    def scan(self):
        ranges = [1.0 + 0.001 * self._random.random()] * 60  # no two scans are equal
        return self.stamped(
            LaserScan(
                angle_min=-2.0, angle_max=2.0, angle_increment=math.tau / 96, scan_time=0.1,
                time_increment=0.1 / 96, range_min=0.02, range_max=5.6, ranges=ranges,
            )
        )  # fmt: skip

    def joint(self):
        pitch = 0.6 * math.sin(self._now_ns / S * 5.0)
        return self.stamped(
            JointState(name=['arm', 'nod_joint'], position=[0.0, pitch], velocity=[0.0, 0.0])
        )

    def tf(self):
        transform = self.stamped(TransformStamped(child_frame_id='nodlidar_base_link'))
        transform.header.frame_id = 'odom'
        return TFMessage(transforms=[transform])

    def spoil_stamp(self, stamp):
        if self._random.random() < 0.5:
            stamp.sec = self._random.choice(SECONDS)
        else:
            stamp.nanosec = self._random.choice(NANOSECONDS)

    def spoil_scan(self, scan):
        choose = self._random.choice
        fields = ('angle_min', 'angle_increment', 'time_increment', 'scan_time', 'range_min')
        what = choose((*fields, 'range_max', 'stamp', 'beams', 'ranges', 'intensities'))
        if what == 'stamp':
            self.spoil_stamp(scan.header.stamp)
        elif what == 'beams':
            scan.ranges = [1.0] * choose(BEAMS)
        elif what in ('ranges', 'intensities'):
            setattr(scan, what, [choose(NUMBERS) for _ in range(choose(BEAMS[:6]))])
        else:
            setattr(scan, what, choose(NUMBERS))

    def spoil_joint(self, state):
        choose = self._random.choice
        what = choose(('stamp', 'name', 'position', 'length', 'other'))
        if what == 'stamp':
            self.spoil_stamp(state.header.stamp)
        elif what == 'name':
            state.name = [choose(NAMES) for _ in range(choose((0, 1, 2, 50)))]
        elif what == 'length':
            state.position = [0.1] * choose((0, 1, 3, 50))
        elif what == 'other':
            state.name = [str(self._random.random())]
        elif state.position:
            state.position[-1] = choose(NUMBERS)

    def spoil_tf(self, message):
        choose = self._random.choice
        what = choose(('stamp', 'frames', 'position', 'rotation', 'number'))
        if what == 'number':
            message.transforms = message.transforms * choose((0, 2, 3))
        for transform in message.transforms[:1]:
            if what == 'stamp':
                self.spoil_stamp(transform.header.stamp)
            elif what == 'frames':
                transform.header.frame_id, transform.child_frame_id = choose(NAMES), choose(NAMES)
            elif what == 'position':
                setattr(transform.transform.translation, choose('xyz'), choose(NUMBERS))
            elif what == 'rotation':
                setattr(transform.transform.rotation, choose('xyzw'), choose(NUMBERS))


class Fed:
    """An assembler node that is given messages by hand."""

    def __init__(self, parameters):
        given = [part for parameter in parameters for part in ('-p', parameter)]
        rclpy.init(args=['--ros-args', *given])
        self.node = AssemblerNode()
        self.node.get_logger().set_level(LoggingSeverity.FATAL)
        self._numbers = dict.fromkeys(('scan', 'joint', 'tf'), 0)

    def feed(self, kind, message, arrived_ns=0):
        self._numbers[kind] += 1
        odometry = self.node.odometry
        inputs = {
            'scan': self.node.scans.callback,
            'joint': self.node.states.callback,
            'tf': odometry and odometry.add,
        }
        if inputs[kind] is None:
            return
        number = self._numbers[kind]
        inputs[kind](
            message, {'publication_sequence_number': number, 'received_timestamp': arrived_ns}
        )


@contextmanager
def fed(*parameters):
    """Give an assembler with parameters like 'cloud_mode:=sweep'."""
    made = Fed(parameters)
    try:
        yield made
    finally:
        # The level of a name stays for the whole process.
        made.node.get_logger().set_level(LoggingSeverity.UNSET)
        made.node.destroy_node()
        rclpy.shutdown()
