import math
import signal
import subprocess
import sys

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from robot_state_publisher.node import RobotStatePublisher
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

URDF = (
    '<robot name="r"><link name="base"/><link name="tilt"/><link name="laser"/>'
    '<joint name="nod" type="continuous"><parent link="base"/><child link="tilt"/>'
    '<axis xyz="0 -1 0"/></joint>'
    '<joint name="mount" type="fixed"><parent link="tilt"/><child link="laser"/>'
    '<origin xyz="0 0 0.08"/></joint></robot>'
)
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
RUN = 'from robot_state_publisher.node import main; raise SystemExit(main())'
MS = 1_000_000


def arguments(**parameters):
    pairs = [('-p', f'{name}:={value}') for name, value in parameters.items()]
    return ['--ros-args', *(word for pair in pairs for word in pair)]


class System:
    """The node with another one that hears it, in one executor."""

    def __init__(self, **parameters):
        rclpy.init(args=arguments(**parameters))
        self.node = RobotStatePublisher()
        self.peer = rclpy.create_node('peer')
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.peer)
        self.heard = {'/tf': [], '/tf_static': [], 'robot_description': []}
        self.hear(TFMessage, '/tf', 100)
        self.hear(TFMessage, '/tf_static', LATCHED)
        self.hear(String, 'robot_description', LATCHED)
        self.states = self.peer.create_publisher(JointState, 'joint_states', 10)
        self.until(lambda: self.states.get_subscription_count() and self.heard['/tf_static'])
        self.until(lambda: self.node.count_subscribers('/tf') and self.heard['robot_description'])

    def hear(self, message_type, topic, qos):
        self.peer.create_subscription(message_type, topic, self.heard[topic].append, qos)

    def until(self, condition):
        while not condition():
            self.executor.spin_once(timeout_sec=self.node.look_period)
            self.node.look()

    def publish(self, stamp_ns, positions=(0.5,), names=('nod',)):
        message = JointState(name=names, position=positions)
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(stamp_ns, 1_000 * MS)
        self.states.publish(message)

    def stamps_ns(self):
        headers = [t.header for m in self.heard['/tf'] for t in m.transforms]
        return [Time.from_msg(header.stamp).nanoseconds for header in headers]

    def close(self):
        self.node.destroy_node()
        self.peer.destroy_node()
        rclpy.shutdown()


@pytest.fixture
def start():
    systems = []

    def start(**parameters):
        systems.append(System(**parameters))
        return systems[-1]

    yield start
    for system in systems:
        system.close()


def test_fixed_joints_moving_joints_and_description(start):
    system = start(robot_description=URDF)
    assert system.heard['robot_description'][0].data == URDF
    [mount] = system.heard['/tf_static'][0].transforms
    assert (mount.header.frame_id, mount.child_frame_id) == ('tilt', 'laser')
    assert mount.transform.translation.z == 0.08
    system.publish(1_500 * MS)
    system.until(lambda: system.heard['/tf'])
    [nod] = system.heard['/tf'][0].transforms
    assert (nod.header.frame_id, nod.child_frame_id) == ('base', 'tilt')
    assert system.stamps_ns() == [1_500 * MS]
    # Half a radian up about -y: (0, -sin(1/4), 0, cos(1/4)).
    assert nod.transform.rotation.y == pytest.approx(-0.24740395925452294)
    assert nod.transform.rotation.w == pytest.approx(0.96891242171064480)


def test_moving_joints_are_throttled_by_their_stamps(start):
    system = start(robot_description=URDF)
    for stamp in (1000, 1049, 1050, 1060, 1100):
        system.publish(stamp * MS)
    system.until(lambda: 1100 * MS in system.stamps_ns())
    assert system.stamps_ns() == [1000 * MS, 1050 * MS, 1100 * MS]


def test_invalid_states_are_ignored(start):
    system = start(robot_description=URDF, publish_frequency='0.0')
    system.publish(2000 * MS, positions=())
    system.publish(3000 * MS, positions=(1.0, 2.0))
    system.publish(-1 * MS)
    system.publish(1000 * MS, positions=(math.inf,))
    for stamp in (1001, 1001, 1002):
        system.publish(stamp * MS)
    system.until(lambda: len(system.stamps_ns()) == 3)
    assert system.stamps_ns() == [1001 * MS, 1001 * MS, 1002 * MS]


def test_changes_of_parameters_are_refused(start):
    system = start(robot_description=URDF)
    for change in (
        Parameter('robot_description', value=URDF.replace('0.08', '0.1')),
        Parameter('publish_frequency', value=50.0),
    ):
        assert not system.node.set_parameters([change])[0].successful


@pytest.mark.parametrize(
    ('parameters', 'message'),
    [
        ({}, 'robot_description parameter must not be empty'),
        ({'robot_description': '<robot/>'}, 'is not a URDF'),
        ({'robot_description': URDF, 'publish_frequency': 'often'}, 'publish_frequency'),
    ],
)
def test_wrong_start_ends_with_a_message(parameters, message):
    command = [sys.executable, '-c', RUN, *arguments(**parameters)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 1
    assert message in ended.stderr
    assert 'Traceback' not in ended.stderr


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_it_cleanly(number):
    rclpy.init()
    peer, heard = rclpy.create_node('peer'), []
    states = peer.create_publisher(JointState, 'joint_states', 10)
    state = JointState(name=['nod'], position=[0.0])
    peer.create_subscription(TFMessage, '/tf', heard.append, 10)
    command = [sys.executable, '-c', RUN, *arguments(robot_description=URDF)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        while not heard:
            state.header.stamp.sec += 1  # what has the same stamp again is not due
            states.publish(state)
            rclpy.spin_once(peer, timeout_sec=0.05)
        process.send_signal(number)
        [initialized] = process.stderr.read().splitlines()
    assert (process.returncode, 'Robot initialized' in initialized) == (0, True)
    peer.destroy_node()
    rclpy.shutdown()
