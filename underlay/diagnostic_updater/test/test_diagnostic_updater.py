from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
import pytest
import rclpy
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


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
    def alive(status):
        status.summary(OK, 'Alive')
        return status

    period = Parameter('diagnostic_updater.period', value=0.05)
    node = node_class('device', namespace='left', parameter_overrides=[period])
    updater = Updater(node)
    assert updater.period == 0.05
    updater.setHardwareID('serial 7')
    updater.add('silent', lambda status: status)
    updater.add('heartbeat', alive)
    silent = receive(node, lambda status: status.message == 'No message was set')
    assert (silent.level, silent.name) == (ERROR, 'device: silent')
    assert silent.hardware_id == 'serial 7'
    alive = receive(node, lambda status: status.message == 'Alive')
    assert (alive.level, alive.name) == (OK, 'device: heartbeat')
    node.destroy_node()


def test_what_is_not_covered_is_named(context):
    import diagnostic_updater

    node = Node('device')
    with pytest.raises(NotImplementedError, match=r'diagnostic_updater\.Heartbeat'):
        _ = diagnostic_updater.Heartbeat
    with pytest.raises(NotImplementedError, match=r'Updater\(period=\)'):
        Updater(node, period=2.0)
    with pytest.raises(NotImplementedError, match=r'Updater\.removeByName'):
        Updater(node).removeByName('silent')
    with pytest.raises(NotImplementedError, match=r'DiagnosticStatusWrapper\.clearSummary'):
        DiagnosticStatusWrapper().clearSummary()
    node.destroy_node()
