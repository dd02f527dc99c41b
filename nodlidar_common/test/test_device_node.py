from contextlib import suppress
from dataclasses import dataclass
import gc
from itertools import groupby
import queue
import signal
import subprocess
import sys
import termios
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.errors import DeviceError, ParameterError, StoppedError
from nodlidar_common.parameters import parameter
from nodlidar_common.report import Report
from nodlidar_common.ros import node as node_module
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.node import run
import pytest
import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from serial import SerialException

SUCCESS = TransitionCallbackReturn.SUCCESS
NOT_ACTIVE = 'not connected: the node is not active'
LONGEST = 30.0  # s; only a failing test waits so long


@dataclass(frozen=True, slots=True)
class Config:
    port: str = parameter('/dev/fake', 'Device file')
    beams: int = parameter(1, 'Beams', minimum=1)
    reconnect_delay: float = parameter(0.001, 'Delay', unit='s', minimum=0.0, live=True)
    autostart: bool = parameter(False, 'Start by itself')


class FakeDevice(DeviceNode):
    """Does what it is told to by `orders`: an exception to raise in connecting or in a cycle."""

    def __init__(self):
        self.steps = queue.Queue()
        self.orders = queue.Queue()
        self.alarm = ''
        super().__init__('fake', Config)

    def configure(self):
        self.beams = self.config.beams
        self.diagnosis = self

    def connect(self):
        self.steps.put('connect')
        self.obey(self.orders.get(timeout=LONGEST))

    def cycle(self):
        with suppress(queue.Empty):
            self.obey(self.orders.get(timeout=0.01))

    def disconnect(self):
        self.steps.put('disconnect')

    def next_report(self, now_ns):
        return Report({'steps': 'some'}, errors=(self.alarm,) if self.alarm else ())

    def urgent(self, now_ns):
        return self.alarm

    def obey(self, order):
        if isinstance(order, Exception):
            raise order
        self.steps.put(order)

    def next_steps(self, count):
        return [self.steps.get(timeout=LONGEST) for _ in range(count)]


@pytest.fixture
def period():
    return 0.02


@pytest.fixture
def device(period):
    rclpy.init(args=['--ros-args', '-p', f'diagnostic_updater.period:={period}'])
    node = FakeDevice()
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def activate(device):
    assert device.trigger_configure() == SUCCESS
    assert device.trigger_activate() == SUCCESS


def status_with(device, message):
    """Spin the node until its diagnostics have a message; return that status."""
    found, deadline = [], time.monotonic() + LONGEST

    def listen(array):
        found.extend(status for status in array.status if status.message == message)

    listener = rclpy.create_node('listener')
    listener.create_subscription(DiagnosticArray, '/diagnostics', listen, 10)
    while not found:
        assert time.monotonic() < deadline, f'no status {message!r}'
        rclpy.spin_once(device, timeout_sec=1.0)
        rclpy.spin_once(listener, timeout_sec=0.01)
    listener.destroy_node()
    return found[0]


def test_nothing_happens_before_activation(device):
    assert device.trigger_configure() == SUCCESS
    status = status_with(device, NOT_ACTIVE)
    assert (status.level, status.name) == (DiagnosticStatus.OK, 'fake: device')
    assert status.hardware_id == '/dev/fake'
    assert device.steps.empty()


def test_device_that_is_missing_and_then_present(device):
    missing = DeviceError('no such port')
    device.orders.put(missing)
    device.orders.put(missing)
    activate(device)
    assert device.next_steps(5) == ['connect', 'disconnect', 'connect', 'disconnect', 'connect']
    assert status_with(device, 'no such port').level == DiagnosticStatus.ERROR
    device.orders.put('there')
    assert device.next_steps(1) == ['there']
    connected = status_with(device, 'connected')
    values = {value.key: value.value for value in connected.values}
    assert connected.level == DiagnosticStatus.OK
    assert values == {'port': '/dev/fake', 'connections': '1', 'steps': 'some'}


@pytest.mark.parametrize('period', [3600.0])
def test_what_is_urgent_is_told_long_before_the_next_update_is_due(device):
    activate(device)
    device.orders.put('there')
    status_with(device, 'connected')
    device.alarm = 'too hot'
    assert status_with(device, 'too hot').level == DiagnosticStatus.ERROR


def test_a_second_publisher_of_a_topic_that_has_one_is_a_warning(device):
    device.sole_topic = '/nod_command'
    for _ in range(2):
        device.create_publisher(DiagnosticArray, 'nod_command', 1)
    activate(device)
    device.orders.put('there')
    warning = '2 publishers on /nod_command: stop all but one'
    assert status_with(device, warning).level == DiagnosticStatus.WARN


def test_device_that_fails_in_mid_cycle_is_connected_again(device):
    activate(device)
    for order in ('first', 'cycle', DeviceError('unplugged'), 'second', 'cycle'):
        device.orders.put(order)
    assert device.next_steps(6) == ['connect', 'first', 'cycle', 'disconnect', 'connect', 'second']
    assert device.thread.connection.count == 2
    assert status_with(device, 'connected').level == DiagnosticStatus.OK


@pytest.mark.parametrize('trouble', [OSError('gone'), SerialException('gone'), termios.error(5)])
def test_an_error_of_the_port_itself_is_the_devices_and_not_the_programs(device, trouble):
    activate(device)
    for order in ('first', trouble, 'second'):
        device.orders.put(order)
    assert device.next_steps(5) == ['connect', 'first', 'disconnect', 'connect', 'second']


def test_a_connection_that_is_given_up_on_deactivation_is_no_trouble(device):
    def wait_until_told(order):
        device.steps.put(order)
        while device.thread.keep_going():
            with suppress(queue.Empty):
                device.orders.get(timeout=0.01)
        raise StoppedError('stopped waiting')

    device.obey = wait_until_told
    activate(device)
    device.orders.put('waiting')
    assert device.next_steps(2) == ['connect', 'waiting']
    assert device.trigger_deactivate() == SUCCESS
    assert device.next_steps(1) == ['disconnect']
    assert status_with(device, NOT_ACTIVE).level == DiagnosticStatus.OK


def test_deactivation_disconnects_and_activation_connects_again(device):
    activate(device)
    device.orders.put('there')
    assert device.next_steps(2) == ['connect', 'there']
    assert device.trigger_deactivate() == SUCCESS
    assert device.next_steps(1) == ['disconnect']
    assert status_with(device, NOT_ACTIVE).level == DiagnosticStatus.OK
    assert device.trigger_cleanup() == SUCCESS
    device.orders.put('again')
    activate(device)
    assert device.next_steps(2) == ['connect', 'again']


def test_an_impossible_transition_is_refused_and_changes_nothing(device):
    client = device.create_client(ChangeState, 'fake/change_state')
    answers = []
    for transition in (Transition.TRANSITION_ACTIVATE, 99, Transition.TRANSITION_CONFIGURE):
        request = ChangeState.Request(transition=Transition(id=transition))
        answer = client.call_async(request)
        rclpy.spin_until_future_complete(device, answer, timeout_sec=LONGEST)
        answers.append(answer.result().success)
    assert answers == [False, False, True]


def test_shutdown_of_an_active_device_disconnects_it(device):
    activate(device)
    device.orders.put('there')
    assert device.next_steps(2) == ['connect', 'there']
    assert device.trigger_shutdown() == SUCCESS
    assert device.next_steps(1) == ['disconnect']


CONFIGURE, CLEANUP = LifecycleNode.trigger_configure, LifecycleNode.trigger_cleanup
ACTIVATE, DEACTIVATE = LifecycleNode.trigger_activate, LifecycleNode.trigger_deactivate
SHUTDOWN = LifecycleNode.trigger_shutdown


@pytest.mark.parametrize(
    'transitions',
    [
        [SHUTDOWN],
        [CONFIGURE, SHUTDOWN],
        [CONFIGURE, CLEANUP, SHUTDOWN],
        [CONFIGURE, CLEANUP, CONFIGURE, ACTIVATE, SHUTDOWN],
        [CONFIGURE, ACTIVATE, DEACTIVATE, ACTIVATE, DEACTIVATE, CLEANUP, SHUTDOWN],
        [CONFIGURE, ACTIVATE, DEACTIVATE, CLEANUP, CONFIGURE, ACTIVATE, DEACTIVATE, SHUTDOWN],
    ],
)
def test_the_device_is_connected_only_while_active_in_any_order(device, transitions):
    steps = []
    for transition in transitions:
        device.orders.put('there')
        assert transition(device) == SUCCESS
        if transition is ACTIVATE:
            steps += device.next_steps(2)
        elif steps and steps[-1] == 'there':
            steps += device.next_steps(1)
        device.orders = queue.Queue()
    assert steps == ['connect', 'there', 'disconnect'] * transitions.count(ACTIVATE)
    assert device.steps.empty()


def test_an_error_in_a_transition_leaves_the_node_unconfigured_and_usable(device):
    publisher = device.create_lifecycle_publisher(DiagnosticArray, 'any', 1)
    activate(device)
    device.orders.put('there')
    assert device.next_steps(2) == ['connect', 'there']
    publisher.on_deactivate = lambda state: TransitionCallbackReturn.ERROR
    assert device.trigger_deactivate() == TransitionCallbackReturn.ERROR
    assert device.next_steps(1) == ['disconnect']
    del publisher.on_deactivate
    device.orders.put('again')
    activate(device)
    assert device.next_steps(2) == ['connect', 'again']


@pytest.mark.parametrize('callback', ['on_configure', 'on_shutdown'])
def test_managed_publishers_hear_of_every_transition(device, callback):
    publisher = device.create_lifecycle_publisher(DiagnosticArray, 'any', 1)
    heard = []
    setattr(publisher, callback, lambda state: heard.append(callback) or SUCCESS)
    activate(device)
    device.orders.put('there')
    assert device.trigger_shutdown() == SUCCESS
    assert heard == [callback]


def test_destroying_an_active_device_disconnects_it(device):
    activate(device)
    device.orders.put('there')
    device.destroy_node()
    assert device.next_steps(3) == ['connect', 'there', 'disconnect']


def test_live_parameters_take_effect(device):
    device.set_parameters([Parameter('reconnect_delay', value=5.0)])
    assert device.config == Config(reconnect_delay=5.0)


def active_device(order):
    """Make an active device that gets an order once it is spun."""
    device = FakeDevice()
    device.orders.put('there')
    activate(device)
    device.create_timer(0.01, lambda: device.orders.put(order))
    return device


@pytest.mark.parametrize('autostart', [False, True])
def test_a_node_starts_by_itself_only_if_told(autostart):
    made = []

    def make():
        made.append(FakeDevice())
        made[0].orders.put('there')
        made[0].create_timer(0.3, lambda: setattr(made[0], 'failed', True))
        return made[0]

    arguments = ['--ros-args', '-p', f'autostart:={str(autostart).lower()}']
    assert run(make, arguments) == 1
    assert made[0].steps.empty() != autostart


def test_a_node_that_cannot_be_configured_says_why_and_ends_if_it_starts_by_itself(capfd):
    class Faulty(FakeDevice):
        def configure(self):
            raise ZeroDivisionError

    def make():
        device = Faulty()
        assert device.trigger_configure() == TransitionCallbackReturn.FAILURE
        return device

    assert run(make, ['--ros-args', '-p', 'autostart:=true']) == 1
    assert capfd.readouterr().err.count('cannot be configured:') == 2


def test_a_fault_of_the_program_leaves_the_device_safe_and_is_tried_again(device, capfd):
    activate(device)
    device.orders.put('first')
    device.orders.put(ZeroDivisionError('a fault of the program'))
    assert device.next_steps(4) == ['connect', 'first', 'disconnect', 'connect']
    trouble = "internal error: ZeroDivisionError('a fault of the program')"
    assert status_with(device, trouble).level == DiagnosticStatus.ERROR
    device.orders.put('second')
    assert status_with(device, 'connected').level == DiagnosticStatus.OK
    assert 'Traceback' in capfd.readouterr().err


def test_a_fault_in_disconnecting_does_not_end_the_device_s_thread(device):
    disconnect, device.disconnect = device.disconnect, lambda: device.obey(ValueError('a fault'))
    activate(device)
    device.orders.put(DeviceError('unplugged'))
    assert device.next_steps(2) == ['connect', 'connect']
    device.disconnect = disconnect
    device.orders.put('there')
    assert device.next_steps(1) == ['there']


def test_a_device_that_does_not_switch_off_is_logged_once_until_it_connects_again(device, capfd):
    def stay_on():
        device.steps.put('disconnect')
        raise DeviceError('the laser is on')

    device.disconnect = stay_on
    missing = DeviceError('no such port')
    activate(device)
    for order in ('there', missing, missing, missing, 'there', missing, missing):
        device.orders.put(order)
    device.next_steps(5 * 2 + 2)
    device.orders.put('there')
    device.next_steps(2)
    assert capfd.readouterr().err.count('switching off failed: the laser is on') == 2


def test_an_exception_in_a_callback_is_logged_and_the_node_goes_on(capfd):
    class Faulty(Node):
        def __init__(self):
            super().__init__('faulty')
            self.failed = False
            self.calls = 0
            self.create_timer(0.001, self.call)

        def call(self):
            self.calls += 1
            self.failed = self.calls == 5
            raise ZeroDivisionError('a fault of the program')

    assert run(Faulty) == 1  # by its fifth call
    log = capfd.readouterr().err
    assert log.count('internal error') == 1
    assert 'ZeroDivisionError: a fault of the program' in log


def test_parameters_can_be_set_until_the_node_is_configured(device):
    [unconfigured] = device.set_parameters([Parameter('beams', value=2)])
    assert unconfigured.successful
    assert device.trigger_configure() == SUCCESS
    assert device.beams == 2
    [configured] = device.set_parameters([Parameter('beams', value=3)])
    assert configured.reason == (
        "'beams' must be 2 until the node is deactivated and cleaned up, but is 3"
    )
    assert device.set_parameters([Parameter('reconnect_delay', value=2.0)])[0].successful
    assert device.trigger_cleanup() == SUCCESS
    assert device.set_parameters([Parameter('beams', value=3)])[0].successful
    assert device.trigger_configure() == SUCCESS
    assert device.beams == 3


def test_a_node_that_runs_keeps_no_memory_for_its_callbacks():
    objects = []

    class Counter(Node):
        def __init__(self):
            super().__init__('counter')
            self.failed = False
            self.calls = 0
            self.create_timer(0.0005, self.call)

        def call(self):
            self.calls += 1
            if self.calls % 500 == 0:
                gc.collect()
                objects.append(len(gc.get_objects()))
            self.failed = len(objects) == 3

    assert run(Counter) == 1
    assert objects[2] - objects[1] < 50


def test_a_successor_takes_over():
    ran = []

    class Relay(Node):
        def __init__(self, number=1):
            super().__init__('relay')
            self.number, self.failed, self.successor = number, False, None
            self.create_timer(0.001, self.call)

        def call(self):
            ran.append((self.number, self.get_node_names().count('relay')))
            self.successor = (lambda: Relay(self.number + 1)) if self.number < 3 else None
            self.failed = self.number == 3

    assert run(Relay) == 1
    assert [each for each, _ in groupby(ran)] == [(1, 1), (2, 1), (3, 1)]


def test_a_node_answers_what_was_asked_before_its_successor_takes_over(monkeypatch):
    """The request is in the queue when the successor is chosen."""
    monkeypatch.setattr(node_module, 'ANSWERING', 5.0)  # a busy host takes its time
    answered = []

    class Asked(Node):
        def __init__(self):
            super().__init__('asked')
            self.failed, self.successor = False, None
            service = self.create_service(ChangeState, 'ask', self.answer)
            client = self.create_client(ChangeState, service.srv_name)
            assert client.wait_for_service(10.0)
            client.call_async(ChangeState.Request()).add_done_callback(answered.append)
            self.successor = lambda: Failing('next')

        def answer(self, request, response):
            response.success = True
            return response

    class Failing(Node):
        failed = True

    assert run(Asked) == 1
    assert [each.result().success for each in answered] == [True]


def test_wrong_parameter_ends_the_process_with_its_name(capsys):
    def make():
        raise ParameterError('rate', 'at least 1', 0)

    assert run(make) == 2
    assert "'rate' must be at least 1, but is 0" in capsys.readouterr().err


def test_a_parameter_of_rclpy_of_the_wrong_type_ends_a_node_in_words(capsys):
    assert run(lambda: Node('talker'), ['--ros-args', '-p', 'use_sim_time:=1']) == 2
    error = capsys.readouterr().err
    assert 'use_sim_time' in error
    assert 'Traceback' not in error


def test_a_topic_whose_name_is_none_ends_a_node_in_words(capsys):
    assert run(lambda: Node('talker').create_publisher(DiagnosticArray, 'a b', 1)) == 2
    error = capsys.readouterr().err
    assert 'Invalid topic name' in error
    assert 'Traceback' not in error


def test_a_parameter_file_that_cannot_be_read_ends_the_process_with_its_name(tmp_path, capsys):
    path = tmp_path / 'broken.yaml'
    path.write_text('/**\n  ros__parameters:\n    - a\n')
    assert run(FakeDevice, ['--ros-args', '--params-file', str(path)]) == 2
    assert str(path) in capsys.readouterr().err


# One that hangs ends by itself, and tells where.
PROGRAM = """
import faulthandler, sys
sys.path.insert(0, sys.argv[1])
from nodlidar_common.ros.node import run
from test_device_node import active_device, FakeDevice, LONGEST
faulthandler.dump_traceback_later(LONGEST, exit=True)
FakeDevice.obey = lambda self, order: print(order, flush=True)
FakeDevice.disconnect = lambda self: print('disconnect', flush=True)
raise SystemExit(run(lambda: active_device('cycle')))
"""


@pytest.fixture
def signals():
    """Restore the handlers of signals, which a program that was ended ignores from then on."""
    numbers = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    before = {number: signal.getsignal(number) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_a_device_is_not_started_if_a_signal_arrives_before_its_node_is_ready(signals):
    started = []

    class Device(FakeDevice):
        def __init__(self):
            super().__init__()
            signal.raise_signal(signal.SIGTERM)

        def autostart(self):
            started.append(self)

    assert run(Device) == 0
    assert not started


def test_a_node_that_is_told_to_end_answers_first(signals):
    calls = []

    class Answering(Node):
        def __init__(self):
            super().__init__('answering')
            self.create_timer(0.001, self.call)

        def call(self):
            calls.append(self.answering)
            if len(calls) == 1:
                signal.raise_signal(signal.SIGTERM)

        @property
        def answering(self):
            return len(calls) < 3

    assert run(Answering) == 0
    assert calls == [True, True, True]


def test_a_node_whose_answer_never_comes_ends_all_the_same(signals, monkeypatch):
    monkeypatch.setattr(node_module, 'ANSWERING_AT_END', 0.3)

    class Answering(Node):
        answering = True

        def __init__(self):
            super().__init__('answering')
            self.create_timer(0.001, lambda: signal.raise_signal(signal.SIGTERM))

    assert run(Answering) == 0


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_ends_the_process_with_the_device_safe(number, request):
    # The test itself may run under nohup, which ignores SIGHUP.
    command = ['env', '--default-signal', sys.executable, '-c', PROGRAM, str(request.path.parent)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        assert [process.stdout.readline() for _ in range(2)] == ['there\n', 'cycle\n']
        process.send_signal(number)
        *cycles, last = process.stdout.read().splitlines()
        log = process.stderr.read()
    assert (process.returncode, last, set(cycles) - {'cycle'}) == (0, 'disconnect', set())
    assert "connected to '/dev/fake'" in log
    assert len(log.splitlines()) == 1, log
