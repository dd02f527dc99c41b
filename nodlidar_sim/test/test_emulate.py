"""The program on real pseudo-terminals, as a process of its own."""

import math
import os
import signal
import subprocess
import sys
import threading
import time

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from nodlidar_common import scip
from nodlidar_common.serial_port import open_port
from nodlidar_common.stamps import time_ns
from nodlidar_sim.commands.emulate import parse, without_ros_args
from nodlidar_sim.commands.entry_points import emulate
from nodlidar_sim.devices.make_devices import make_devices
from nodlidar_sim.devices.trajectory_controller import TrajectoryError
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.ros.joint_controller import trajectory_of
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
import rclpy
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import JointState, LaserScan
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

LONGEST = 30.0  # s; then a process is killed, so that no read waits for ever
RUN = 'import sys; from nodlidar_sim.commands.entry_points import emulate; sys.exit(emulate())'
PING = bytes.fromhex('FFFF010201FB')
PING_ANSWER = bytes.fromhex('FFFF010200FC')


@pytest.fixture
def start():
    processes, watchdogs = [], []

    def start(*arguments):
        process = subprocess.Popen(
            [sys.executable, '-c', RUN, *map(str, arguments)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        processes.append(process)
        watchdogs.append(threading.Timer(LONGEST, process.kill))
        watchdogs[-1].start()
        return process

    yield start
    for process, watchdog in zip(processes, watchdogs, strict=True):
        watchdog.cancel()
        process.kill()
        process.communicate()


def ask(port, command):
    port.write(command + b'\n')
    return port.read_until(b'\n\n').split(b'\n')


@pytest.mark.parametrize('ending', [signal.SIGINT, signal.SIGTERM])
def test_both_devices_answer_and_the_links_go_with_the_process(start, tmp_path, ending):
    lidar, servo = tmp_path / 'dev' / 'lidar', tmp_path / 'dev' / 'servo'
    process = start('--lidar-link', lidar, '--servo-link', servo, '--ros-args', '-r', '__node:=x')
    assert process.stdout.readline() == f'lidar ready at {lidar}\n'
    assert process.stdout.readline() == f'servo ready at {servo}\n'
    with open_port(str(lidar), 115200, 5.0) as port:
        assert ask(port, b'QT')[:2] == [b'QT', b'00P']
        assert ask(port, b'MD0044072501003')[1] == b'00P'
        stamps = []
        for _ in range(3):
            lines = port.read_until(b'\n\n').split(b'\n')
            assert len(scip.join_blocks(lines[3:-2])) == 3 * 682
            stamps.append(int(scip.decode(lines[2][:4], 4)[0]))
        assert np.diff(stamps).tolist() == [100, 100]
    with open_port(str(servo), 1_000_000, 5.0) as port:
        port.write(PING)
        assert port.read(6) == PING_ANSWER
    process.send_signal(ending)
    assert process.wait(10) == 0
    assert not (tmp_path / 'dev').exists()


def test_one_device_alone(start, tmp_path):
    process = start('--servo-link', tmp_path / 'servo', '--scene', 'wall')
    assert process.stdout.readline().startswith('servo ready')
    assert os.listdir(tmp_path) == ['servo']


@pytest.fixture
def listener():
    rclpy.init()
    node = rclpy.create_node('listener')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def heard(node, kind, topic, condition):
    """Return the first message of a topic for which a condition holds."""
    found = []
    node.create_subscription(kind, topic, lambda m: found.append(m) if condition(m) else None, 50)
    deadline = time.monotonic() + LONGEST
    while not found:
        assert time.monotonic() < deadline
        rclpy.spin_once(node, timeout_sec=0.1)
    return found[0]


def test_the_base_publishes_its_odometry_on_the_way(start, tmp_path, listener):
    process = start(
        '--servo-link', tmp_path / 'servo', '--scene=wall', '--route=approach', '--base=odometry',
        '--ros-args', '-r', '__ns:=/robot',
    )  # fmt: skip
    message = heard(listener, Odometry, '/robot/odom', lambda m: m.pose.pose.position.x > 0.1)
    assert message.twist.twist.linear.x == pytest.approx(0.3)
    assert message.pose.pose.position.y == 0.0
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 0
    assert os.listdir(tmp_path) == []


def test_the_base_is_driven_by_cmd_vel(start, tmp_path, listener):
    start('--servo-link', tmp_path / 'servo', '--scene=corridor', '--base=cmd_vel')
    command = Twist()
    command.angular.z = 0.7
    publisher = listener.create_publisher(Twist, 'cmd_vel', 10)
    listener.create_timer(0.05, lambda: publisher.publish(command))
    message = heard(listener, Odometry, 'odom', lambda m: m.pose.pose.orientation.z > 0.1)
    assert message.pose.pose.position.x == 0.0


def test_a_lidar_with_a_driver_publishes_scans_beside_the_odometry(start, listener):
    """At rest at pitch 0, 2 m in front of the wall."""
    start(
        '--lidar-model=rplidar', '--frame-id=left_laser', '--scene=wall', '--ideal',
        '--base=odometry', '--ros-args', '-r', '__ns:=/left',
    )  # fmt: skip
    scan = heard(listener, LaserScan, '/left/scan', lambda m: True)
    assert scan.header.frame_id == 'left_laser'
    front = [scan.ranges[i] for i in (359, 360)]  # half a step of 2 pi / 719 beside azimuth 0
    assert front == pytest.approx([2.0 / np.cos(np.pi / 719)] * 2, rel=1e-6)
    assert scan.ranges[0] == np.inf  # nothing behind
    heard(listener, Odometry, '/left/odom', lambda m: True)


@pytest.mark.parametrize(
    ('name', 'reliability'),
    [('ydlidar', ReliabilityPolicy.BEST_EFFORT), ('ldlidar', ReliabilityPolicy.RELIABLE)],
)
def test_scans_have_the_quality_of_service_of_their_driver(start, listener, name, reliability):
    process = start(f'--lidar-model={name}', '--scene=wall')
    deadline = time.monotonic() + LONGEST
    while not (found := listener.get_publishers_info_by_topic('/scan')):
        assert time.monotonic() < deadline
        rclpy.spin_once(listener, timeout_sec=0.1)
    assert [each.qos_profile.reliability for each in found] == [reliability]
    process.send_signal(signal.SIGTERM)
    assert process.wait(10) == 0


def test_a_joint_of_ros2_control_is_held_then_goes_where_it_is_sent(start, listener):
    process = start(
        '--servo-model=trajectory', '--joint-name=left_joint', '--controller=nod', '--ideal',
        '--ros-args', '-r', '__ns:=/left',
    )  # fmt: skip
    held = heard(listener, JointState, '/left/joint_states', lambda m: True)
    assert (list(held.name), list(held.position)) == (['left_joint'], [0.0])
    publisher = listener.create_publisher(JointTrajectory, '/left/nod/joint_trajectory', 1)
    end = JointTrajectoryPoint(positions=[0.4], time_from_start=Duration(nanosec=50_000_000))

    def send():
        for joint in ('right_joint', 'left_joint'):  # the former is refused
            publisher.publish(JointTrajectory(joint_names=[joint], points=[end]))

    timer = listener.create_timer(0.5, send)
    is_there = lambda m: abs(m.position[0] - 0.4) < 1e-9  # noqa: E731
    there = heard(listener, JointState, '/left/joint_states', is_there)
    assert time_ns(there.header.stamp) - time_ns(held.header.stamp) >= 50_000_000
    listener.destroy_timer(timer)
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 0
    assert 'trajectory refused: its joints are not left_joint' in process.stderr.read()


@pytest.mark.parametrize(
    ('point', 'reason'),
    [
        ({'velocities': [0.0]}, 'lacks a value'),
        ({'positions': [0.0], 'velocities': [0.0, 0.0]}, 'lacks a value'),
        ({'positions': [0.0], 'effort': [1.0]}, 'has an effort'),
        ({'positions': [math.nan]}, 'not finite'),
        ({'positions': [0.0], 'velocities': [math.inf]}, 'not finite'),
        ({'positions': [0.0], 'accelerations': [0.0]}, 'without a velocity'),
    ],
)
def test_a_point_with_other_values_than_the_controller_takes_is_refused(point, reason):
    message = JointTrajectory(joint_names=['joint'], points=[JointTrajectoryPoint(**point)])
    with pytest.raises(TrajectoryError, match=reason):
        trajectory_of(message, ['joint'])


def test_a_servo_at_another_bit_rate_is_silent(start, tmp_path):
    start('--servo-link', tmp_path / 'servo').stdout.readline()
    with open_port(str(tmp_path / 'servo'), 57600, 0.2) as port:
        port.write(PING)
        assert port.read(6) == b''


def test_scip_1_1(start, tmp_path):
    start('--lidar-link', tmp_path / 'lidar', '--scip11').stdout.readline()
    with open_port(str(tmp_path / 'lidar'), 19200, 5.0) as port:
        assert ask(port, b'QT')[:2] == [b'QT', b'E']
        assert ask(port, b'SCIP2.0')[:2] == [b'SCIP2.0', b'0']


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--lidar-link', 'l', '--scene', 'nowhere'], 'corner, corridor, crossing, room, wall'),
        ([], 'no device to emulate'),
        (['--lidar-link', 'l', '--route', 'nowhere'], 'approach, figure_of_eight, turn'),
        (['--lidar-link', 'l', '--base', 'fly'], '--base'),
        (['--lidar-link', 'l', '--cmd-vel-timeout', '0'], 'at most 3600 s, but is 0.0'),
        (['--lidar-link', 'l', '--latency-timer', 'nan'], 'from 0 to 255 ms, but is nan'),
        (['--servo-link', 's', '--servo-model', 'S3003'], 'XL430-W250'),
        (['--lidar-link', 'l', '--lidar-model', 'rplidar'], 'rplidar publishes scan'),
        (['--servo-link', 's', '--servo-model', 'trajectory'], 'publishes joint_states'),
        (['--lidar-link', 'l', '--seed', 'x'], '--seed'),
        (['--lidar-link', 'l', '--seed', '-1'], 'at least 0, but is -1'),
    ],
)
def test_what_is_not_allowed_is_a_line_with_status_2(capsys, arguments, message):
    assert emulate(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith('emulate: error: ')
    assert message in error
    assert error.count('\n') == 1


def test_a_link_that_cannot_be_created_is_a_line_with_status_1(start):
    process = start('--lidar-link', '/dev/null')
    _, stderr = process.communicate(timeout=20)
    assert process.returncode == 1
    assert stderr.startswith('emulate: error: ')
    assert 'no symbolic link' in stderr
    assert stderr.count('\n') == 1


def test_arguments_of_ros_are_ignored():
    arguments = ['--seed', '3', '--ros-args', '-p', 'a:=1', '--', '--scip11', '--ros-args']
    assert without_ros_args(arguments) == ['--seed', '3', '--scip11']
    options = parse(['--lidar-link', 'l', *arguments])
    assert (options.seed, options.scip11) == (3, True)


def test_the_lidar_sees_the_wall_that_the_servo_points_it_at():
    """At pitch p a beam of length r ends r cos p - z_off sin p ahead: at the wall, 2 m away."""
    start_ns = 10**18
    scene = load_scene('wall', ideal=True)
    devices = make_devices(scene, start_ns, seed=0)
    clock = VirtualClock(start_ns)
    servo = VirtualPort(devices['servo'], clock, timeout=0.1)
    lidar = VirtualPort(devices['lidar'], clock, timeout=1.0)
    ranges = {}
    for goal in (512, 600):
        body = bytes((1, 5, 3, 30, goal & 255, goal >> 8))
        servo.write(b'\xff\xff' + body + bytes((~sum(body) & 0xFF,)))
        assert servo.read(6)[4] == 0
        clock.advance_to(clock() + 10**9)
        lidar.reset_input_buffer()
        lidar.write(b'MD0384038401001\n')
        reply = lidar.read(16 + 4 + 1 + 16 + 4 + 6 + 5 + 1)
        ranges[goal] = scip.decode(reply.split(b'\n')[6][:3], 3)[0] / 1000.0
    pitch = 88 * np.radians(300) / 1024
    assert ranges[512] == 2.0
    expected = (2.0 + scene.optical_offset * np.sin(pitch)) / np.cos(pitch)
    assert ranges[600] == pytest.approx(expected, abs=0.0011)
