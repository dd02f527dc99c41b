from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater import (
    _monitors,
    CompositeDiagnosticTask,
    DiagnosedPublisher,
    DiagnosticStatusWrapper,
    FrequencyStatus,
    FrequencyStatusParam,
    FunctionDiagnosticTask,
    Heartbeat,
    TimeStampStatus,
    TimeStampStatusParam,
    Updater,
)
import pytest
import rclpy
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from std_msgs.msg import Header

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
S = 1_000_000_000


@pytest.fixture
def now(monkeypatch):
    """A clock that stands still at now[0] ns."""
    time = [1_700_000_000 * S]
    monkeypatch.setattr(_monitors, '_now_ns', lambda: time[0])
    return time


@pytest.fixture
def context():
    rclpy.init()
    yield
    rclpy.shutdown()


class TestStatus:
    @pytest.mark.parametrize(
        ('level', 'other', 'merged'),
        [
            (OK, OK, (OK, 'old; new')),
            (OK, WARN, (WARN, 'new')),
            (WARN, OK, (WARN, 'old')),
            (WARN, ERROR, (ERROR, 'old; new')),
            (ERROR, WARN, (ERROR, 'old; new')),
        ],
    )
    def test_merged_summary(self, level, other, merged):
        status = DiagnosticStatusWrapper(level=level, message='old')
        status.mergeSummary(other, 'new')
        assert (status.level, status.message) == merged

    def test_values(self):
        status = DiagnosticStatusWrapper()
        status.add('key', 'value')
        assert [(v.key, v.value) for v in status.values] == [('key', 'value')]


def test_composite_runs_each_task_on_the_summary_it_came_with():
    seen = []

    def task(level, message):
        def run(status):
            seen.append(status.message)
            status.summary(level, message)
            return status

        return FunctionDiagnosticTask(message, run)

    composite = CompositeDiagnosticTask('both')
    composite.addTask(task(WARN, 'a'))
    composite.addTask(task(ERROR, 'b'))
    status = composite.run(DiagnosticStatusWrapper(level=OK, message='before'))
    assert seen == ['before', 'before']
    assert (status.level, status.message) == (ERROR, 'a; b')


class TestFrequency:
    @pytest.mark.parametrize(
        ('ticks', 'level', 'message'),
        [
            (0, ERROR, 'No events recorded.'),
            (8, WARN, 'Frequency too low.'),
            (9, OK, 'Desired frequency met'),
            (22, OK, 'Desired frequency met'),
            (23, WARN, 'Frequency too high.'),
        ],
    )
    def test_verdict(self, now, ticks, level, message):
        monitor = FrequencyStatus(FrequencyStatusParam({'min': 10.0, 'max': 20.0}))
        for _ in range(ticks):
            monitor.tick()
        now[0] += S
        status = monitor.run(DiagnosticStatusWrapper())
        assert (status.level, status.message) == (level, message)
        values = {v.key: v.value for v in status.values}
        assert values['Actual frequency (Hz)'] == f'{ticks:f}'
        assert values['Minimum acceptable frequency (Hz)'] == '9.000000'

    def test_window_slides(self, now):
        monitor = FrequencyStatus(FrequencyStatusParam({'min': 1.0}, window_size=2))
        counts = []
        for ticks in (4, 0, 0, 0):
            for _ in range(ticks):
                monitor.tick()
            now[0] += S
            counts.append(monitor.run(DiagnosticStatusWrapper()).values[0].value)
        assert counts == ['4', '4', '0', '0']


class TestTimeStamps:
    @pytest.mark.parametrize(
        ('ages', 'level', 'message'),
        [
            ([], WARN, 'No data since last update.'),
            ([0.1, 1.9], OK, 'Timestamps are reasonable.'),
            ([0.1, 2.1], ERROR, 'Timestamps too far in past seen.'),
            ([-0.6, 0.1], ERROR, 'Timestamps too far in future seen.'),
        ],
    )
    def test_verdict(self, now, ages, level, message):
        monitor = TimeStampStatus(TimeStampStatusParam(-0.5, 2.0))
        for age in ages:
            monitor.tick(Time(nanoseconds=now[0] - round(age * S)))
        status = monitor.run(DiagnosticStatusWrapper())
        assert (status.level, status.message) == (level, message)

    def test_zero_stamp_is_an_error_among_others(self, now):
        monitor = TimeStampStatus()
        monitor.tick(0.0)
        monitor.tick(now[0] * 1e-9)
        assert monitor.run(DiagnosticStatusWrapper()).message == 'Zero timestamp seen.'
        assert monitor.run(DiagnosticStatusWrapper()).message == 'No data since last update.'


def receive(node, condition):
    """Spin until a status on /diagnostics fulfils the condition; return it."""
    found = []

    def listen(message):
        found.extend(status for status in message.status if condition(status))

    subscription = node.create_subscription(DiagnosticArray, '/diagnostics', listen, 10)
    while not found:
        rclpy.spin_once(node, timeout_sec=1.0)
    node.destroy_subscription(subscription)
    return found[0]


@pytest.mark.parametrize('node_class', [Node, LifecycleNode])
def test_updates_are_published_periodically(context, node_class):
    period = Parameter('diagnostic_updater.period', value=0.05)
    node = node_class('device', parameter_overrides=[period])
    updater = Updater(node)
    updater.setHardwareID('serial 7')
    updater.add('silent', lambda status: status)
    updater.add(Heartbeat())
    silent = receive(node, lambda status: status.message == 'No message was set')
    assert (silent.level, silent.name) == (ERROR, 'device: silent')
    assert silent.hardware_id == 'serial 7'
    alive = receive(node, lambda status: status.message == 'Alive')
    assert (alive.level, alive.name) == (OK, 'device: Heartbeat')
    assert updater.removeByName('silent')
    assert not updater.removeByName('silent')
    node.destroy_node()


def test_full_names_and_broadcast(context):
    fqn = Parameter('diagnostic_updater.use_fqn', value=True)
    node = Node('device', namespace='left', parameter_overrides=[fqn])
    updater = Updater(node, period=0.05)
    assert node.get_parameter('diagnostic_updater.period').value == 0.05
    updater.add(Heartbeat())
    node.create_timer(0.02, lambda: updater.broadcast(WARN, 'going down'))
    status = receive(node, lambda status: status.message == 'going down')
    assert (status.level, status.name) == (WARN, '/left/device: Heartbeat')
    node.destroy_node()


def test_diagnosed_publisher(context):
    class Stamped:
        header = Header()

    class Recorder:
        topic_name = '/scan'

        def __init__(self):
            self.published = []

        def publish(self, message):
            self.published.append(message)

    node = Node('device')
    recorder, message = Recorder(), Stamped()
    message.header.stamp = node.get_clock().now().to_msg()
    publisher = DiagnosedPublisher(
        recorder, Updater(node), FrequencyStatusParam({'min': 0.0}), TimeStampStatusParam()
    )
    publisher.publish(message)
    status = publisher.run(DiagnosticStatusWrapper())
    assert recorder.published == [message]
    assert publisher.getName() == '/scan topic status'
    assert status.message == 'Desired frequency met; Timestamps are reasonable.'
    node.destroy_node()
