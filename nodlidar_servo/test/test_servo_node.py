"""The node as users run it: its own process, real DDS, an emulated servo on a pseudo-terminal."""

from contextlib import contextmanager
import math
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nodlidar_common.nod import Nod
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.messages import nod_to_message
from nodlidar_common.ros.node import run
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand, NodStatus
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.ros.node import ServoNode
from nodlidar_sim.devices import rx_table as table
from nodlidar_sim.devices.rx_motor import TICK
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from sensor_msgs.msg import JointState

TIMEOUT = 20.0
SWEEP = 4001 * 0.1 / 1024
MAIN = 'from nodlidar_servo.ros.node import main; main()'


def start(*parameters, namespace=''):
    """Start the node with parameters 'key:=value'."""
    options = [word for parameter in parameters for word in ('-p', parameter)]
    options += ['-r', f'__ns:={namespace or "/"}']
    return subprocess.Popen(
        [sys.executable, '-c', MAIN, '--ros-args', *options],
        stderr=subprocess.PIPE,
        text=True,
    )


class Commander:
    """The other side of the node: gives commands, collects what it publishes."""

    def __init__(self):
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('commander', context=self.context)
        self.executor = Executor(context=self.context)
        self.executor.add_node(self.node)
        self.joint_states, self.status, self.nod_status = [], None, []
        self.nod = None
        self.spoil = lambda message: None
        self.node.create_subscription(JointState, 'joint_states', self.joint_states.append, 50)
        self.node.create_subscription(NodStatus, 'servo/status', self.nod_status.append, 10)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self._commands = self.node.create_publisher(NodCommand, 'nod_command', 10)
        self.node.create_timer(0.1, self._command)
        self._life_cycles = {
            namespace: [
                self.node.create_client(kind, f'{namespace}/servo/{service}')
                for kind, service in ((ChangeState, 'change_state'), (GetState, 'get_state'))
            ]
            for namespace in ('', '/second')
        }

    def _on_diagnostics(self, message):
        for status in message.status:
            if 'servo' in status.name:
                self.status = status

    def _command(self):
        if self.nod is not None:
            message = nod_to_message(self.nod, time.time_ns(), 'nodlidar_base_link')
            self.spoil(message)
            self._commands.publish(message)

    def spin_until(self, condition, what):
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < deadline, f'{what}; last status: {self.status}'
            self.executor.spin_once(timeout_sec=0.05)

    def change_state(self, transition, namespace=''):
        change, state = self._life_cycles[namespace]
        self.spin_until(change.service_is_ready, 'no life cycle service')
        # A node drops its responses to clients that it has not found, and finds them in the order
        # in which they were made: one that answers a later client has found the first, too.
        questions = []

        def answered():
            questions.append(state.call_async(GetState.Request()))
            return any(question.done() for question in questions)

        self.spin_until(answered, 'no state')
        future = change.call_async(ChangeState.Request(transition=Transition(id=transition)))
        self.spin_until(future.done, 'the transition did not end')
        assert future.result().success

    def activate(self, namespace=''):
        self.change_state(Transition.TRANSITION_CONFIGURE, namespace)
        self.change_state(Transition.TRANSITION_ACTIVATE, namespace)

    def receive(self, count):
        """Return the next joint states."""
        self.joint_states.clear()
        self.spin_until(lambda: len(self.joint_states) >= count, f'no {count} joint states')
        return list(self.joint_states)

    def values(self):
        return {item.key: item.value for item in self.status.values} if self.status else {}

    def message(self):
        return self.status.message if self.status else ''

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def commander():
    commander = Commander()
    yield commander
    commander.close()


@pytest.fixture
def motion():
    return IdealServo(0.2, history=1e6)


@pytest.fixture
def emulator(motion):
    return RxServoEmulator(motion, baud=1)


@pytest.fixture
def ports(emulator):
    with PseudoTerminals({'servo': emulator}) as ports:
        yield ports


@pytest.fixture
def linked(emulator, tmp_path):
    with PseudoTerminals({'servo': emulator}, {'servo': tmp_path / 'servo'}) as ports:
        yield ports


@contextmanager
def running(*parameters, namespace=''):
    process = start(*parameters, namespace=namespace)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=TIMEOUT)
        finally:
            process.kill()


@contextmanager
def active(commander, ports, *parameters):
    with running(f'port:={ports["servo"]}', *parameters) as process:
        commander.activate()
        yield process


def nod_from_now():
    return Nod(-0.6136, 0.6136, SWEEP, 4001, time.time_ns())


def torque(emulator):
    return emulator.table[table.TORQUE_ENABLE]


def test_samples_that_wait_for_later_ones_are_published_although_the_port_fails(monkeypatch):
    rclpy.init()
    try:
        node, published = ServoNode(), []
        publisher = SimpleNamespace(publish=lambda state: published.append(state.position[0]))
        monkeypatch.setattr(node, '_joint_states', publisher)
        node._samples = [Sample(k, 0.1 * k, 0.0, 0.0, 12.0, 30, 0) for k in range(3)]
        node.disconnect()
        node.disconnect()
        node.destroy_node()
    finally:
        rclpy.shutdown()
    assert published == [0.0, 0.1, 0.2]


def test_it_nods_and_tells_the_truth(commander, emulator, motion, ports):
    with active(commander, ports, 'joint_name:=neck'):
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        messages = commander.receive(200)
        commander.spin_until(lambda: commander.values().get('torque') == 'on', 'no diagnostics')
    stamps = np.array([time_ns(message.header.stamp) for message in messages])
    pitch = np.array([message.position[0] for message in messages])
    velocity = np.array([message.velocity[0] for message in messages])
    assert all(m.name == ['neck'] and m.header.frame_id == '' for m in messages)
    assert all(len(m.effort) == 1 for m in messages)
    assert np.median(np.diff(stamps)) == pytest.approx(10e6, rel=0.05)
    error = np.abs(pitch - motion.position(stamps))
    assert np.median(error) <= TICK / 2
    assert np.ptp(pitch) == pytest.approx(1.2272, abs=2 * TICK)
    assert np.median(np.abs(velocity)) == pytest.approx(commander.nod.speed, rel=0.1)
    assert commander.status.level != DiagnosticStatus.ERROR
    assert commander.status.hardware_id == ports['servo']
    assert commander.values()['voltage [V]'] == '12.0'


def on_time(status):
    return abs(status.measured_samples_per_sweep - 4001) < 20 and abs(status.phase_error) < 0.01


def test_it_tells_how_well_it_follows(commander, ports):
    with active(commander, ports):
        commander.spin_until(lambda: commander.nod_status, 'no status')
        assert not commander.nod_status[-1].following
        assert math.isnan(commander.nod_status[-1].phase_error)
        commander.nod = nod_from_now()
        # In time, since a turn that the host delays is made up for.
        commander.spin_until(lambda: on_time(commander.nod_status[-1]), 'no N_s and phase')
        commander.spin_until(lambda: 'phase error [ms]' in commander.values(), 'no diagnostics')
    status, nod = commander.nod_status[-1], commander.nod
    assert status.following
    assert (status.pitch_lower_limit, status.pitch_upper_limit) == (-0.8, 0.8)
    assert status.samples_per_sweep == 4001
    assert (status.pitch_min, status.pitch_max) == (nod.pitch_min, nod.pitch_max)
    assert status.speed == pytest.approx(nod.speed)
    assert commander.values()['samples per sweep, commanded'] == '4001'


def test_a_servo_that_does_not_follow_is_diagnosed_and_tried_again(commander, emulator, ports):
    with active(commander, ports) as process:
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        commander.receive(50)  # until the node knows that too
        assert commander.nod_status[-1].following

        def held():
            emulator.table[table.TORQUE_LIMIT] = 0  # and again, should the node write its own
            return 'does not follow' in commander.message()

        commander.spin_until(held, 'not named')
        assert commander.status.level == DiagnosticStatus.ERROR
        commander.spin_until(lambda: not commander.nod_status[-1].following, 'following')
        commander.spin_until(lambda: commander.nod_status[-1].following, 'not tried again')
        commander.spin_until(lambda: 'does not follow' not in commander.message(), 'still named')
        assert torque(emulator)
        process.send_signal(signal.SIGINT)
        _, log = process.communicate(timeout=TIMEOUT)
    assert log.count('does not follow') == 1
    assert 'the servo follows again' in log


def test_a_blocked_servo_that_gets_hot_is_diagnosed(commander, emulator, motion, ports):
    motion.set_goal = lambda now_ns, *_: motion.brake(now_ns)
    with active(commander, ports):
        commander.nod = nod_from_now()
        commander.spin_until(lambda: 'does not follow' in commander.message(), 'not named')
        emulator.motor.temperature = 85.0
        # The reply to a command may say so before the next sample has the temperature.
        commander.spin_until(
            lambda: (
                'overheating' in commander.message()
                and commander.values()['temperature [deg C]'] == '85'
            ),
            'not named with its temperature',
        )


def test_torque_goes_off_on_deactivation(commander, emulator, ports):
    with active(commander, ports):
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        commander.change_state(Transition.TRANSITION_DEACTIVATE)
        assert not torque(emulator)
        commander.change_state(Transition.TRANSITION_ACTIVATE)
        commander.spin_until(lambda: torque(emulator), 'no torque after activating again')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_torque_goes_off_and_the_node_ends_cleanly_on_a_signal(commander, emulator, ports, number):
    with active(commander, ports) as process:
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        process.send_signal(number)
        _, log = process.communicate(timeout=TIMEOUT)
        assert process.returncode == 0, log
        assert 'Traceback' not in log
    assert not torque(emulator)


def test_torque_goes_off_when_the_node_is_killed(commander, emulator, ports):
    with active(commander, ports) as process:
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        process.kill()
        commander.spin_until(lambda: not torque(emulator), 'torque on')


def test_torque_goes_off_when_commands_stop_and_that_is_diagnosed(commander, emulator, ports):
    with active(commander, ports, 'command_timeout:=0.5'):
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        commander.nod = None
        commander.spin_until(lambda: not torque(emulator), 'torque still on')
        commander.spin_until(
            lambda: 'no nod command to follow' in commander.message(), 'no warning'
        )
        assert commander.status.level == DiagnosticStatus.WARN
        commander.receive(10)
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque again')


def test_a_commander_that_sends_only_what_is_refused_loses_the_torque(commander, emulator, ports):
    with active(commander, ports) as process:
        commander.nod = nod_from_now()
        commander.spin_until(lambda: torque(emulator), 'no torque')
        commander.spoil = lambda message: setattr(message, 'pitch_max', math.nan)
        commander.spin_until(lambda: 'pitch_max' in commander.message(), 'no refusal')
        assert commander.status.level == DiagnosticStatus.WARN
        assert "'pitch_max' must be finite, but is nan" in commander.message()
        assert int(commander.values()['refused commands']) > 0
        commander.spin_until(lambda: not torque(emulator), 'torque on')
        process.send_signal(signal.SIGINT)
        _, log = process.communicate(timeout=TIMEOUT)
    assert log.count('nod command refused') == 1


def test_a_second_commander_is_diagnosed(commander, ports):
    with active(commander, ports):
        commander.nod = nod_from_now()
        commander.spin_until(lambda: commander.message() == 'connected', 'not connected')
        commander.node.create_publisher(NodCommand, 'nod_command', 10)
        commander.spin_until(lambda: '2 publishers' in commander.message(), 'no warning')
        assert commander.status.level == DiagnosticStatus.WARN


def test_it_comes_back_after_unplugging(commander, linked):
    with active(commander, linked, 'reconnect_delay:=0.1'):
        commander.receive(5)
        linked.close_device('servo')
        commander.spin_until(lambda: 'does not exist' in commander.message(), 'no error')
        assert commander.status.level == DiagnosticStatus.ERROR
        linked.reopen('servo')
        commander.receive(50)
        commander.spin_until(lambda: commander.values().get('connections') == '2', 'no return')


def test_it_waits_for_a_port_that_is_not_there_yet(commander, emulator, tmp_path):
    link = tmp_path / 'servo'
    with running(f'port:={link}', 'reconnect_delay:=0.1'):
        commander.activate()
        commander.spin_until(lambda: 'is the device plugged in' in commander.message(), 'no hint')
        with PseudoTerminals({'servo': emulator}, {'servo': link}):
            commander.receive(20)


def test_a_second_instance_on_the_same_port_says_so_and_does_not_disturb(commander, ports):
    with active(commander, ports):
        commander.receive(5)
        with running(f'port:={ports["servo"]}', namespace='/second'):
            commander.activate('/second')
            commander.spin_until(lambda: 'in use' in commander.message(), 'not refused')
            commander.receive(50)


def test_a_wrong_parameter_ends_the_program_with_a_sentence():
    process = start('baud_rate:=fast')
    _, log = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert "'baud_rate' must be of type int, but is 'fast'" in log
    assert 'Traceback' not in log


@pytest.mark.parametrize(
    ('parameter', 'words'),
    [
        ('model:=XL-320', "'model' must be one of RX-24F, RX-28, RX-64, AX-12A"),
        ('pitch_upper_limit:=-0.9', "'pitch_upper_limit' must be above pitch_lower_limit"),
        ('feedback_rate:=1e6', "'feedback_rate' must be between"),
    ],
)
def test_other_wrong_parameters_are_named_with_their_limits(parameter, words, capsys):
    assert run(ServoNode, ['--ros-args', '-p', parameter]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert 'Traceback' not in error
