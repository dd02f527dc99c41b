"""The command calibrate with the running sensor: parameters of the assembler, and odometry."""

from contextlib import contextmanager
from dataclasses import replace
from itertools import count
import threading
import time
from types import SimpleNamespace

from geometry_msgs.msg import TransformStamped
from log_messages import state_message
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.calibration.beam_model import CalibrationError
from nodlidar_assembler.calibration.recorded import log_of_bag, require_standing
from nodlidar_assembler.commands.calibrate import main
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ros import live_log
from nodlidar_common.nod import Nod
from nodlidar_common.parameter_file import file_values
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.node_parameters import declare
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import pytest
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage

NOD = Nod(-0.61, 0.61, 4001 * 0.1 / 1024, 4001, 10**18)
RUNNING = replace(
    AssemblerConfig(),
    joint_name='left_nod_joint',
    laser_xyz=(0.01, 0.02, -0.08),
    laser_rpy=(3.14159, 0.0, 0.0),
    mount_tilt=(0.0, 0.3),
)


@contextmanager
def running(name, namespace=''):
    """Run another node, as if in a process of its own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node(name, namespace=namespace, context=context)
    executor = Executor(context=context)
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    try:
        yield node, spinning.start
    finally:
        executor.shutdown()
        rclpy.shutdown(context=context)
        spinning.join()


@contextmanager
def running_assembler():
    """Run a node in the namespace left that has parameters and hears scans as the assembler."""
    with running('assembler', 'left') as (node, start):
        declare(node, AssemblerConfig, defaults=RUNNING)
        node.create_subscription(LaserScan, 'scan', lambda message: None, 5)
        start()
        yield


def transform(parent, child, stamp_ns=0, x=0.0):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, time_message(stamp_ns)
    message.transform.translation.x, message.transform.rotation.w = x, 1.0
    return TFMessage(transforms=[message])


@contextmanager
def running_robot(step):
    """Run a robot that goes a step [m] per scan; yield a clock that stops until 20 are sent."""
    sent, numbers, deadline = threading.Event(), count(), time.monotonic() + 30.0

    def monotonic():
        assert time.monotonic() < deadline
        return 1e9 if sent.is_set() else 0.0

    with running('robot') as (node, start):
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        scan, joint, tf, static = publishers = [
            node.create_publisher(kind, topic, qos)
            for kind, topic, qos in (
                (LaserScan, 'scan', 10),
                (JointState, 'joint_states', 10),
                (TFMessage, '/tf', 10),
                (TFMessage, '/tf_static', latched),
            )
        ]
        static.publish(transform('base_link', 'nodlidar_base_link', x=0.1))

        def publish():
            if not all(each.get_subscription_count() for each in publishers):
                return
            number = next(numbers)
            stamp_ns = 10**18 + number * 100_000_000
            tf.publish(transform('odom', 'base_link', stamp_ns, number * step))
            joint.publish(state_message(stamp_ns, 0.0))
            message = LaserScan(angle_increment=0.01, range_max=5.0, ranges=[1.0] * 10)
            message.header.stamp = time_message(stamp_ns)
            scan.publish(message)
            if number >= 20:
                sent.set()

        node.create_timer(0.01, publish)
        start()
        yield SimpleNamespace(monotonic=monotonic)


@pytest.fixture
def node():
    rclpy.init()
    yield rclpy.create_node('calibrate')
    rclpy.shutdown()


def test_the_assembler_that_hears_the_scans_is_asked(node):
    with running_assembler():
        assert live_log.running_config(node, 'left/scan') == RUNNING


def test_without_an_assembler_defaults_are_taken_and_said(node, monkeypatch, capsys):
    monkeypatch.setattr(live_log, 'ANSWER', 0.1)
    assert live_log.running_config(node, 'right/scan') == AssemblerConfig()
    assert "no assembler hears '/right/scan'" in capsys.readouterr().err


@pytest.mark.parametrize('params', [False, True])
def test_what_the_scene_leaves_open_stays_as_the_node_has_it(tmp_path, monkeypatch, params):
    """The y of the lidar shows in no scene; a parameter file overrides that of the node."""
    write_bag(
        simulate(load_scene('room', ideal=True), NOD, 2.5, start_ns=10**18), tmp_path / 'bag'
    )
    file = tmp_path / 'params.yaml'
    file.write_text('/**: {ros__parameters: {laser_xyz: [0.0, 0.03, 0.08]}}')
    running = replace(AssemblerConfig(), laser_xyz=(0.0, 0.02, 0.08))

    def record(config, *_):
        config = config or running
        return log_of_bag(tmp_path / 'bag', config, Topics('', '', '')), config

    found = tmp_path / 'found.yaml'
    options = ['--params', str(file)] if params else []
    monkeypatch.setattr(live_log, 'record', record)
    main(['live', '--output', str(found), *options])
    y = file_values([found], 'assembler', AssemblerConfig)['laser_xyz'][1]
    assert y == (0.03 if params else 0.02)


def test_a_robot_that_moves_is_named(tmp_path, monkeypatch):
    """It goes 5 cm in every tenth of a second, which is named as in a bag."""
    with running_robot(0.05) as clock:
        monkeypatch.setattr(live_log, 'time', clock)
        log, _ = live_log.record(AssemblerConfig(), 'scan', 'joint_states', 60.0)
    options = ['live', '--output', str(tmp_path / 'found.yaml')]
    monkeypatch.setattr(live_log, 'record', lambda *_: (log, AssemblerConfig()))
    with pytest.raises(CalibrationError, match=r'the robot moves in this recording, by .* 0 rad'):
        main(options)


def test_a_robot_that_stands_is_taken(monkeypatch):
    with running_robot(0.0) as clock:
        monkeypatch.setattr(live_log, 'time', clock)
        log, _ = live_log.record(AssemblerConfig(), 'scan', 'joint_states', 60.0)
    assert len(log.odometry.time_ns) > 2
    require_standing(log)


def test_odometry_that_cannot_be_read_is_named(tmp_path, capsys):
    """Where it is a chain of moving transforms, nothing tells whether the robot stands."""
    write_bag(
        simulate(load_scene('room', ideal=True), NOD, 2.5, start_ns=10**18), tmp_path / 'bag'
    )
    config = AssemblerConfig(odom_frame='elsewhere')
    log = log_of_bag(tmp_path / 'bag', config, Topics('', '', ''))
    assert log.odometry is None
    [text] = log.damage
    assert text.startswith('that the robot stands was not checked: ')
