"""Faults put into running nodes, on real DDS: the command doctor finds and names each."""

from contextlib import contextmanager
import json
import math
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from nodlidar_bringup.commands.entry_points import doctor
from nodlidar_common.ros.executor import Executor
from nodlidar_msgs.msg import NodCommand
import pytest
import rclpy
from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from tf2_msgs.msg import TFMessage

FUTURE = 3 * 10**9
ASSEMBLER = {
    'frame_id': 'nodlidar_base_link',
    'laser_xyz': [0.0, 0.0, 0.08],
    'laser_rpy': [0.0] * 3,
    'cloud_mode': 'scan',
    'sweeps_per_cloud': 1,
    'deadline': 0.3,
    'scan_delay': 0.0,
    'joint_delay': 0.0,
}


@pytest.fixture(scope='module')
def faulty_system():
    """Run nodes with many faults."""
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = Executor(context=context)
    driver = rclpy.create_node(
        'driver',
        context=context,
        parameter_overrides=[
            Parameter('use_sim_time', value=True),
            Parameter('port', value='/dev/ttyACM77'),
        ],
        automatically_declare_parameters_from_overrides=True,
    )
    servo = rclpy.create_node('servo', context=context)
    twins = [rclpy.create_node('assembler', context=context) for _ in range(2)]
    for node in (driver, servo, *twins):
        executor.add_node(node)
    unreliable = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    scans = driver.create_publisher(LaserScan, 'scan', unreliable)
    twins[0].create_subscription(LaserScan, 'scan', lambda message: None, 5)  # reliable
    joints = [servo.create_publisher(JointState, 'joint_states', 5) for _ in range(2)]
    transforms = servo.create_publisher(TFMessage, '/tf', 5)
    status = driver.create_publisher(DiagnosticArray, '/diagnostics', 5)

    def publish():
        now_ns = time.time_ns()
        scan = LaserScan(ranges=[float('inf')] * 10)
        scan.header.frame_id = 'urg'
        scan.header.stamp = Time(nanoseconds=now_ns + FUTURE).to_msg()
        scans.publish(scan)
        state = JointState(name=['left_nod_joint'], position=[0.0])
        for late_ns in (10**7, 2 * 10**7):
            state.header.stamp = Time(nanoseconds=now_ns - late_ns).to_msg()
            joints[0].publish(state)
        tree = TFMessage()
        for parent in ('base_link', 'nodlidar_tilt_link'):
            transform = TransformStamped(child_frame_id='laser')
            transform.header.frame_id = parent
            tree.transforms.append(transform)
        transforms.publish(tree)
        late = DiagnosticStatus(
            level=DiagnosticStatus.ERROR, name='servo: device', message='supply is 5.0 V'
        )
        status.publish(DiagnosticArray(status=[late]))

    servo.create_timer(0.05, publish)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    yield
    executor.shutdown()
    rclpy.shutdown(context=context)
    spinning.join()


def test_each_fault_is_named(faulty_system, capsys):
    assert doctor(['--json', '--seconds', '1', '--servo-port', '/dev/ttyUSB77']) == 1
    report = json.loads(capsys.readouterr().out)
    findings = [finding for each in report['subjects'].values() for finding in each]
    found = {each['check']: each for each in findings if each['level'] in ('warning', 'fault')}
    assert {
        *('port missing', 'two nodes of one name', 'no simulated time', 'no publisher'),
        *('two publishers', 'quality of service', 'stamps in the future', 'unknown frame'),
        'stamps go back',
        *('lidar sees nothing', 'joint missing', 'two parents', 'reported'),
    } <= found.keys()
    # That of the nod is missing since no position of the joint comes.
    (tilt,) = (each for each in findings if each['check'] == 'transform missing')
    assert tilt['level'] == 'unknown'
    assert report['subjects']['mount'] == []
    missing, _ = (each for each in findings if each['check'] == 'port missing')
    assert '/dev/ttyACM77' in missing['text']  # the parameter of the driver
    assert 'supply the servo' in found['reported']['remedy']
    assert report['faults'] >= 12


@contextmanager
def spinning_node(name, namespace, **parameters):
    """Yield a node with parameters that spins in a thread."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node(
        name,
        namespace=namespace,
        context=context,
        parameter_overrides=[Parameter(key, value=value) for key, value in parameters.items()],
        automatically_declare_parameters_from_overrides=True,
    )
    executor = Executor(context=context)
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    try:
        yield node
    finally:
        executor.shutdown()
        rclpy.shutdown(context=context)
        spinning.join()


def subjects(capsys, *options):
    doctor(['--json', '--seconds', '1', '--no-ask', *options])
    return json.loads(capsys.readouterr().out)['subjects']


def test_the_port_of_hardware_that_ros2_control_drives_is_left_alone(capsys):
    with spinning_node('servo', 'apart', controller='joint_trajectory_controller'):
        options = ['--namespace', '/apart', '--servo-port', '/dev/ttyUSB77']
        ports = subjects(capsys, *options)['ports']
    assert [each for each in ports if 'servo' in each['text']] == []


def test_the_ports_of_what_nodes_of_others_publish_are_not_missed(capsys):
    with spinning_node('sllidar_node', 'other') as lidar, spinning_node('joint', 'other') as joint:
        lidar.create_publisher(LaserScan, 'scan', 5)
        ports = subjects(capsys, '--namespace', '/other')['ports']
        assert [each['text'].startswith("the servo's port") for each in ports] == [True]
        joint.create_publisher(JointState, 'joint_states', 5)
        assert subjects(capsys, '--namespace', '/other')['ports'] == []
        given = subjects(capsys, '--namespace', '/other', '--lidar-port', '/dev/ttyACM77')
    assert [each['check'] for each in given['ports']] == ['port missing']


def test_a_joint_whose_position_is_missing_is_a_fault(capsys):
    """A message may have fewer positions than names."""
    with spinning_node('servo', 'short') as servo:
        states = servo.create_publisher(JointState, 'joint_states', 5)
        state = JointState(name=['arm', 'nod_joint'], position=[0.0])
        servo.create_timer(0.05, lambda: states.publish(state))
        found = subjects(capsys, '--namespace', '/short/')
    assert 'no joint position' in [finding['check'] for finding in found['messages']]
    assert found['mount'] == []
    # That of the nod is missing since no position of the joint comes.
    (tilt,) = (each for each in found['transforms'] if 'of which none come' in each['text'])
    assert tilt['level'] == 'unknown'


@pytest.mark.parametrize(
    ('behind', 'on_sim_time', 'words'),
    [(0.0, True, []), (30.0, True, ["'joint_states' are 30 s behind /clock"]), (0.0, False, None)],
)
def test_stamps_are_compared_with_the_clock_of_their_node(capsys, behind, on_sim_time, words):
    """Without the servo's node on simulated time, its stamps by /clock are years behind."""
    others = ASSEMBLER | {'frame_id': 'base', 'cloud_mode': 'scan', 'use_sim_time': True}
    with (
        spinning_node('servo', 'simulated', use_sim_time=on_sim_time) as servo,
        spinning_node('assembler', 'simulated', **others),
    ):
        clock = servo.create_publisher(Clock, '/clock', 1)
        states = servo.create_publisher(JointState, 'joint_states', 5)
        begin_ns = time.monotonic_ns()

        def publish():
            now_ns = 10**18 + time.monotonic_ns() - begin_ns
            clock.publish(Clock(clock=Time(nanoseconds=now_ns).to_msg()))
            state = JointState(name=['nod_joint'], position=[0.4 * math.sin(now_ns / 1e9)])
            state.header.stamp = Time(nanoseconds=now_ns - round(behind * 1e9)).to_msg()
            states.publish(state)

        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        servo.create_timer(0.05, publish, clock=steady)
        messages = subjects(capsys, '--namespace', '/simulated')['messages']
    past = [each['text'] for each in messages if each['check'] == 'stamps in the past']
    if words is None:
        assert [text.endswith("behind this computer's clock") for text in past] == [True]
    else:
        assert [text.replace('stamps on ', '') for text in past] == words


def test_clouds_of_slow_sweeps_are_no_fault(capsys):
    settings = ASSEMBLER | {'cloud_mode': 'sweep', 'sweeps_per_cloud': 2}
    sweep = 1.5  # s
    with spinning_node('assembler', 'slow', **settings) as node:
        commands = node.create_publisher(NodCommand, 'nod_command', 1)
        clouds = node.create_publisher(PointCloud2, 'points', 1)

        def cloud():
            stamp_ns = time.time_ns() - round(2.0 * sweep * 1e9)  # of its first point
            message = PointCloud2()
            message.header.stamp = Time(nanoseconds=stamp_ns).to_msg()
            clouds.publish(message)

        command = NodCommand(sweep_duration=sweep)
        node.create_timer(0.1, lambda: commands.publish(command))
        node.create_timer(2.0 * sweep, cloud)
        messages = subjects(capsys, '--namespace', '/slow')['messages']
    assert [each['check'] for each in messages] == ['rate'], messages


def test_frames_and_joint_of_a_sensor_have_the_prefix_of_its_assembler(capsys):
    settings = ASSEMBLER | {'frame_id': 'second_nodlidar_base_link'}
    with spinning_node('assembler', 'second', **settings) as node:
        states = node.create_publisher(JointState, 'joint_states', 5)
        state = JointState(name=['second_nod_joint'], position=[0.0])
        node.create_timer(0.05, lambda: states.publish(state))
        of_own = subjects(capsys, '--namespace', '/second')
        of_other = subjects(capsys, '--namespace', '/second', '--frame-prefix', 'third_')
    checks = [{each['check'] for each in of['messages']} for of in (of_own, of_other)]
    assert ['joint missing' in found for found in checks] == [False, True]
    missing = [
        each['text'] for each in of_own['transforms'] if each['check'] == 'transform missing'
    ]
    assert any("'second_laser'" in text for text in missing)


def test_joints_of_other_parts_of_a_robot_are_no_fault(capsys):
    with spinning_node('servo', 'armed') as servo, spinning_node('arm', 'armed') as arm:
        joints = {servo: 'nod_joint', arm: 'elbow'}
        topics = {node: node.create_publisher(JointState, 'joint_states', 9) for node in joints}

        def publish(node):
            # Older than those of the nod joint: on their topic, stamps go back.
            now_ns = time.time_ns() - (node is arm) * 50_000_000
            state = JointState(name=[joints[node]], position=[math.sin(now_ns / 1e9)])
            state.header.stamp = Time(nanoseconds=now_ns).to_msg()
            topics[node].publish(state)

        servo.create_timer(0.02, lambda: publish(servo))
        arm.create_timer(0.02, lambda: publish(arm))
        found = subjects(capsys, '--namespace', '/armed')
    checks = {each['check'] for each in [*found['nodes'], *found['messages']]}
    assert checks.isdisjoint({'two publishers', 'stamps go back', 'joint missing'}), found


def test_a_node_that_answers_nothing_hangs(capsys):
    context = rclpy.Context()
    rclpy.init(context=context)
    hung = rclpy.create_node('servo', namespace='hung', context=context)  # nobody spins it
    try:
        with spinning_node('driver', 'hung'):
            nodes = subjects(capsys, '--namespace', '/hung')['nodes']
    finally:
        hung.destroy_node()
        rclpy.shutdown(context=context)
    assert [each['text'] for each in nodes if each['check'] == 'node hangs'] == [
        "'/hung/servo' runs, but answers no request: it hangs"
    ]
