"""The node as users run it, on real DDS; the controller is that of the simulation."""

from contextlib import contextmanager
import math
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from nodlidar_common.nod import Nod
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import nod_to_message, time_message
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand, NodStatus
from nodlidar_servo.joint_trajectory.joint_sample import JointSample, JointSampleFilter
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.ros.trajectory_node import add_state, TrajectoryNode
from nodlidar_sim.devices.trajectory_controller import TrajectoryController, TrajectoryError
from nodlidar_sim.ros.joint_controller import trajectory_of
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.time import Time
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

TIMEOUT = 20.0
HOUR_NS = 3600 * 10**9
MAIN = 'from nodlidar_servo.ros.trajectory_node import main; main()'


def test_joint_states_without_a_value_of_the_joint_are_no_measurements():
    def measured(stamp_ns, **values):
        message = JointState(name=['wheel', 'nod_joint'], **values)
        message.header.stamp = time_message(stamp_ns)
        samples = JointSampleFilter(TrajectoryConfig().dynamics)
        samples.add(10**9, 0.1, 0.0)
        return add_state(message, 'nod_joint', samples, lambda stamp_ns: stamp_ns > 1)

    assert measured(1, position=[1.0, 0.2]) is None
    assert measured(2 * 10**9) is None
    assert measured(2 * 10**9, position=[1.0]) is None
    assert measured(10**9, position=[1.0, 0.2]) is None
    assert measured(10**9 - 1, position=[1.0, 0.2]) is None
    for velocity in ([], [5.0], [5.0, math.nan]):
        sample = measured(3 * 10**9, position=[1.0, 0.2], velocity=velocity)
        assert sample == JointSample(3 * 10**9, 0.2, pytest.approx(0.05))
    assert measured(3 * 10**9, position=[1.0, 0.2], velocity=[5.0, -0.3]).velocity == -0.3


class Robot:
    """The other side of the node: gives commands, and has the controller."""

    def __init__(self):
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('robot', context=self.context)
        self.executor = Executor(context=self.context)
        self.executor.add_node(self.node)
        self.nod, self.message, self.statuses, self.pitches = None, '', [], []
        self.published_ns = []  # when the joint was at each of the pitches
        self.start_ns = 0  # of the nod
        self.offset = 0.0  # rad, of joint states
        self.reports = []  # messages of the diagnostics
        self.controller = TrajectoryController()
        self.controller.update(time.time_ns(), 0.1, 0.0)
        self.joints, self.takes_some, self.takes = ['nod_joint'], False, True
        self.points, self.refusals = [], []  # of the latest trajectory: time [ns], position
        self.states_stop, self.states_late_ns, self.ends = False, 0, []
        self.unstamped = False
        self.stray = None  # a joint state after every twentieth, of another publisher
        self.ahead = 0  # every so many joint states, one is stamped an hour ahead
        self.spare = 0  # from the latest arrival of a trajectory to its end [ns]
        self._commands = self.node.create_publisher(NodCommand, 'nod_command', 10)
        self._states = self.node.create_publisher(JointState, 'joint_states', 10)
        self._strays = self.node.create_publisher(JointState, 'joint_states', 10)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self.node.create_subscription(NodStatus, 'servo/status', self.statuses.append, 10)
        self.node.create_timer(0.1, self._command)

    def start_controller(self):
        self.node.create_timer(0.01, self._publish_state)
        self.node.create_subscription(
            JointTrajectory, 'joint_trajectory_controller/joint_trajectory', self._take, 1
        )

    def _on_diagnostics(self, message):
        for status in message.status:
            if 'servo' in status.name:
                self.message = status.message
                self.reports.append(status.message)

    def _command(self):
        if self.nod is not None:
            about = time.time_ns(), 'nodlidar_base_link', self.start_ns
            self._commands.publish(nod_to_message(self.nod, *about))

    def _publish_state(self):
        now_ns = time.time_ns()
        pitch, velocity = self.controller.at(now_ns)
        self.controller.update(now_ns, pitch, velocity)
        self.pitches.append(pitch)
        self.published_ns.append(now_ns)
        other = JointState(
            name=['wheel', 'nod_joint'], position=[1.0, pitch + self.offset], velocity=[]
        )
        other.header.stamp = time_message(now_ns - self.states_late_ns)
        if self.unstamped:
            other.header.stamp = time_message(0)
        if self.ahead and len(self.pitches) % self.ahead == 0:
            other.header.stamp = time_message(now_ns + HOUR_NS)
        if not self.states_stop:
            self._states.publish(other)
        if self.stray is not None and len(self.pitches) % 20 == 0:
            other.header.stamp = time_message(now_ns + 1_000_000)
            other.position = [1.0, self.stray]
            self._strays.publish(other)

    def _take(self, message):
        now_ns, last = time.time_ns(), message.points[-1]
        self.ends.append(last.positions[0])
        self.spare = time_ns(message.header.stamp) + time_ns(last.time_from_start) - now_ns
        start_ns = time_ns(message.header.stamp)
        self.points = [
            (start_ns + time_ns(point.time_from_start), point.positions[0])
            for point in message.points
        ]
        # With allow_partial_joints_goal, fill_partial_goal of the controller adds what is missing.
        joints = self.joints[-1:] if self.takes_some else self.joints
        try:
            if self.takes:
                self.controller.accept(trajectory_of(message, joints), now_ns)
        except TrajectoryError as error:
            self.refusals.append(str(error))

    def until(self, condition, what):
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < deadline, f'{what}; last: {self.message}'
            self.executor.spin_once(timeout_sec=0.02)

    def is_in_phase(self):
        return self.statuses and abs(self.statuses[-1].phase_error) < 1e-3

    def rests(self):
        last = self.pitches[-20:]
        return max(last) - min(last) < 1e-6

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def robot():
    robot = Robot()
    yield robot
    robot.close()


@contextmanager
def running(*parameters):
    options = [word for parameter in parameters for word in ('-p', parameter)]
    process = subprocess.Popen([sys.executable, '-c', MAIN, '--ros-args', *options])
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=TIMEOUT)
        finally:
            process.kill()


def test_a_joint_of_ros2_control_nods_and_rests_whenever_it_is_left_alone(robot):
    nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    with running('autostart:=true', 'reconnect_delay:=0.1') as process:
        robot.until(lambda: 'no controller listens' in robot.message, 'not diagnosed')
        robot.start_controller()
        robot.until(lambda: 'no nod command' in robot.message, 'not connected')
        assert robot.points == []  # nothing moves unasked
        robot.nod = nod
        robot.until(robot.is_in_phase, 'not in phase')
        assert robot.statuses[-1].following
        assert robot.statuses[-1].samples_per_sweep == 4001
        robot.pitches.clear()
        robot.until(lambda: len(robot.pitches) > 100, 'no joint states')
        assert min(robot.pitches) == pytest.approx(-0.3, abs=0.02)
        assert max(robot.pitches) == pytest.approx(0.4, abs=0.02)
        robot.nod = None
        robot.until(robot.rests, 'the joint goes on without commands')
        assert robot.spare > 200_000_000  # so no delay of the network makes a controller refuse it
        robot.nod = nod
        robot.until(lambda: not robot.rests(), 'the joint does not start again')
        process.kill()
        robot.until(robot.rests, 'the joint goes on after the node was killed')
        assert robot.pitches[-1] == pytest.approx(robot.points[-1][1])
        assert time.time_ns() >= robot.points[-1][0]
    assert robot.refusals == []


def test_controllers_that_start_after_the_node_are_awaited(robot):
    with running('autostart:=true'):
        robot.until(lambda: len(robot.reports) >= 3, 'no diagnostics')
        robot.start_controller()
        robot.until(lambda: robot.statuses, 'not connected')
    assert not any('listens' in each or 'joint states' in each for each in robot.reports)


def test_a_nod_that_is_commanded_for_later_is_planned_before_it_begins(robot):
    slow = Nod(-0.3, 0.4, 2.0, 4001, time.time_ns())
    robot.nod = slow
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(lambda: robot.statuses and robot.statuses[-1].following, 'does not follow')
        start_ns = slow.reversal_time_ns(2 * math.ceil(slow.sweep_at(time.time_ns()) / 2.0 + 1.0))
        robot.nod, robot.start_ns = Nod(-0.3, 0.4, 0.5, 4001, start_ns), start_ns

        def is_planned():
            assert time.time_ns() < start_ns, 'not before it begins'
            # The fast leg after the start, by one that tuning may have moved a little.
            legs = [abs(each[0] - start_ns - 5 * 10**8) for each in robot.points]
            return min(legs, default=10**9) < 5 * 10**7

        robot.until(is_planned, 'not planned')
    assert robot.refusals == []


def test_a_nod_begins_by_a_simulated_clock_at_whatever_rate_it_passes():
    rclpy.init()
    node = TrajectoryNode()
    clock = node.get_clock()
    clock._set_ros_time_is_active(True)

    def now_in_effect(now_ns):
        clock.set_ros_time_override(Time(nanoseconds=now_ns, clock_type=clock.clock_type))
        return node.commands.follow(steady_ns(), node.start_clock_ns()).nod.samples_per_sweep

    for n_s, start_ns in ((4001, 0), (7547, 10**10)):
        clock.set_ros_time_override(Time(nanoseconds=10**9, clock_type=clock.clock_type))
        nod = Nod(-0.3, 0.4, 0.8, n_s, start_ns)
        node._on_command(nod_to_message(nod, 10**9, 'nodlidar_base_link', start_ns))
        now_in_effect(10**9)
    assert [now_in_effect(10**10 - 1), now_in_effect(10**10)] == [4001, 7547]
    node.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize('can_wait', [True, False])
def test_a_node_that_ends_waits_until_its_stop_has_arrived(can_wait):
    class Publisher:
        def publish(self, message):
            done.append([point.positions[0] for point in message.points])

        def wait_for_all_acked(self, timeout):
            done.append(timeout.nanoseconds > 0)
            if not can_wait:
                raise RuntimeError

    rclpy.init()
    node, done = TrajectoryNode(), []
    sent_to, node._trajectory = node._trajectory, Publisher()
    node._samples.add(node.now_ns(), 0.2, 0.0)
    node._is_moving = True
    node.disconnect()
    assert done == [[0.2, 0.2], True]
    node.disconnect()
    assert len(done) == 2, 'it stops once'
    node._trajectory = sent_to
    node.destroy_node()
    rclpy.shutdown()


def test_a_joint_that_stands_still_is_told_though_the_nod_passes_it(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(robot.is_in_phase, 'not in phase')
        robot.takes = False
        robot.until(lambda: 'does not follow' in robot.message, 'not diagnosed')
        robot.takes = True
        robot.until(lambda: robot.message == 'connected', 'does not recover')


def test_a_controller_of_more_joints_takes_the_nod_if_partial_goals_are_allowed(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.joints = ['pan_joint', 'nod_joint']
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(lambda: robot.refusals, 'nothing is sent')
        assert set(robot.refusals) == {'its joints are not pan_joint, nod_joint'}
        robot.takes_some = True
        robot.refusals.clear()
        robot.until(robot.is_in_phase, 'not in phase')
    assert robot.refusals == []


def test_a_joint_whose_states_stop_rests_at_a_reversal(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(robot.is_in_phase, 'not in phase')
        robot.until(lambda: abs(robot.pitches[-1] - 0.05) < 0.03, 'not in mid-span')
        robot.ends.clear()
        robot.states_stop = True
        robot.until(lambda: 'no joint states' in robot.message, 'not diagnosed')
        robot.until(robot.rests, 'the joint goes on')
    assert {round(end, 6) for end in robot.ends} <= {-0.3, 0.4}
    assert robot.refusals == []


@pytest.mark.parametrize('seconds', [1.0, 3.0])
def test_a_node_that_stood_still_blames_no_clock_and_goes_on(robot, seconds):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=1.5') as process:
        robot.until(robot.is_in_phase, 'not in phase')
        robot.reports.clear()
        process.send_signal(signal.SIGSTOP)
        stopped = time.monotonic()
        robot.until(lambda: time.monotonic() > stopped + seconds, 'time stands still')
        robot.statuses.clear()
        process.send_signal(signal.SIGCONT)
        robot.until(lambda: robot.statuses and robot.is_in_phase(), 'not in phase again')
        robot.until(lambda: len(robot.reports) > 2, 'no diagnostics')
    assert not [text for text in robot.reports if 'clocks' in text or 'no joint states' in text]
    assert robot.refusals == []


def test_a_node_that_often_stands_still_notices_that_joint_states_stop(robot, monkeypatch):
    slow = (
        'import time; from nodlidar_servo.ros import trajectory_node as module\n'
        'class Slow(module.TrajectoryNode):\n'
        '    def cycle(self):\n'
        '        time.sleep(0.45)\n'
        '        super().cycle()\n'
        'module.TrajectoryNode = Slow; module.main()'
    )
    monkeypatch.setitem(globals(), 'MAIN', slow)
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(lambda: robot.statuses and robot.statuses[-1].following, 'does not follow')
        robot.states_stop = True
        robot.until(lambda: 'no joint states' in robot.message, 'not diagnosed')


@pytest.mark.parametrize('late_s', [-3600, 2])
def test_clocks_that_differ_are_named_and_nothing_moves(robot, late_s):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.states_late_ns = late_s * 10**9
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(lambda: 'clocks' in robot.message, 'not diagnosed')
        assert robot.points == []
        robot.states_late_ns = 0  # as after a clock was set, or when a simulated one begins
        robot.until(robot.is_in_phase, 'does not recover')
        robot.until(lambda: robot.message == 'connected', 'what waited meanwhile counts as wrong')


@pytest.mark.parametrize(
    ('early_ms', 'way'), [(300, 'before'), (110, 'before'), (-110, 'after'), (-300, 'after')]
)
def test_stamps_that_are_a_little_wrong_are_named_and_move_the_joint_no_faster(
    robot, early_ms, way
):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    robot.states_late_ns = early_ms * 1_000_000
    with running('autostart:=true'):
        robot.until(lambda: f's {way} they arrive' in robot.message, 'not diagnosed')
        robot.pitches.clear()
        robot.until(lambda: len(robot.pitches) > 300, 'no joint states')
        # The controller has a stop near a reversal some ms late, and passes the limit: to 18 mrad.
        assert min(robot.pitches) >= -0.32
        assert max(robot.pitches) <= 0.42
        assert max(robot.pitches) > min(robot.pitches) + 0.2, 'it does not move'
        robot.nod = None
        robot.until(robot.rests, 'the joint goes on without commands')
    assert not any('impossible' in each for each in robot.reports)
    assert robot.refusals == []


def test_joint_states_that_come_again_with_early_stamps_make_no_joint_jump(robot):
    """They stop early in a leg of 4 s, which goes on meanwhile."""
    robot.nod = nod = Nod(-0.7, 0.7, 4.0, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(robot.is_in_phase, 'not in phase')
        robot.until(lambda: 0.05 < nod.sweep_at(time.time_ns()) % 1.0 < 0.1, 'does not begin')
        robot.states_stop, robot.states_late_ns = True, 450_000_000
        robot.until(lambda: 'no joint states' in robot.message, 'not diagnosed')
        robot.states_stop = False
        robot.until(lambda: 'no joint states' not in robot.message, 'does not recover')
        robot.until(lambda: nod.sweep_at(time.time_ns()) % 1.0 > 0.9, 'does not end')
    times, pitches = np.array(robot.published_ns) / 1e9, np.array(robot.pitches)
    assert np.abs(np.diff(pitches) / np.maximum(np.diff(times), 5e-3)).max() < 1.35 * 2.0 * 0.35


def test_joint_states_with_another_zero_are_named_though_the_joint_follows(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    robot.offset = 0.1
    with running('autostart:=true'):
        robot.until(lambda: '+0.10 rad off the nod' in robot.message, 'not diagnosed')
        robot.offset = 0.0
        robot.until(lambda: robot.message == 'connected', 'stays, though it is right again')


def test_joint_states_without_a_stamp_are_named_and_nothing_moves(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.unstamped = True
    robot.start_controller()
    with running('autostart:=true', 'reconnect_delay:=0.1'):
        robot.until(lambda: 'have no stamp' in robot.message, 'not diagnosed')
        assert 'clocks' not in robot.message
    assert robot.points == []


def test_single_joint_states_of_another_time_are_left_out_and_counted(robot):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'joint_timeout:=5.0'):  # no pause of this host matters
        robot.until(robot.is_in_phase, 'not in phase')
        robot.ahead = 20
        robot.statuses.clear()
        robot.until(lambda: 'joint states with a wrong stamp' in robot.message, 'not diagnosed')
        robot.pitches.clear()
        robot.until(lambda: len(robot.pitches) > 200, 'no joint states')
        assert all(status.following for status in robot.statuses)
        assert min(robot.pitches) == pytest.approx(-0.3, abs=0.02)
        assert max(robot.pitches) == pytest.approx(0.4, abs=0.02)
    assert robot.refusals == []


@pytest.mark.parametrize('stray', [3.14, 1e300])
def test_joint_states_that_are_not_of_the_joint_move_nothing_and_are_counted(robot, stray):
    robot.nod = Nod(-0.3, 0.4, 0.4, 4001, time.time_ns())
    robot.start_controller()
    with running('autostart:=true', 'joint_timeout:=5.0'):  # no pause of this host matters
        robot.until(robot.is_in_phase, 'not in phase')
        robot.stray = stray
        robot.pitches.clear()
        robot.until(lambda: 'with an impossible position' in robot.message, 'not diagnosed')
        robot.until(lambda: len(robot.pitches) > 200, 'no joint states')
        assert min(robot.pitches) == pytest.approx(-0.3, abs=0.02)
        assert max(robot.pitches) == pytest.approx(0.4, abs=0.02)
        robot.nod = None
        robot.until(robot.rests, 'the joint goes on without commands')
    # It brakes within 32 mrad.
    assert -0.34 < min(robot.pitches) < max(robot.pitches) < 0.44
    assert not any('internal error' in each for each in robot.reports)
    assert robot.refusals == []


def test_the_qos_of_its_topics_can_be_overridden(robot):
    node, trajectories = robot.node, '/joint_trajectory_controller/joint_trajectory'
    overrides = [
        'qos_overrides./joint_states.subscription.reliability:=reliable',
        'qos_overrides./nod_command.subscription.reliability:=best_effort',
        'qos_overrides./servo/status.publisher.reliability:=best_effort',
        f'qos_overrides.{trajectories}.publisher.reliability:=best_effort',
    ]

    def found():
        return [
            each.qos_profile.reliability.name
            for endpoints in (
                node.get_subscriptions_info_by_topic('/joint_states'),
                node.get_subscriptions_info_by_topic('/nod_command'),
                node.get_publishers_info_by_topic('/servo/status'),
                node.get_publishers_info_by_topic(trajectories),
            )
            for each in endpoints
            if each.node_name == 'servo'
        ]

    with running(*overrides):
        robot.until(lambda: len(found()) == len(overrides), 'not all topics')
        assert found() == ['RELIABLE', *['BEST_EFFORT'] * 3]
