from types import SimpleNamespace

from nodlidar_common.errors import PortError
from nodlidar_servo.bus.latency import reduce_latency
import pytest


@pytest.fixture
def adapter(tmp_path):
    """Return a port, the tty class it is described in and its latency timer."""
    device = tmp_path / 'class' / 'ttyUSB7' / 'device'
    device.mkdir(parents=True)
    timer = device / 'latency_timer'
    timer.write_text('16\n')
    node = tmp_path / 'ttyUSB7'
    node.touch()
    link = tmp_path / 'by-id'
    link.symlink_to(node)

    def set_low_latency_mode(on):
        timer.write_text('1\n' if on else '16\n')

    port = SimpleNamespace(port=str(link), set_low_latency_mode=set_low_latency_mode)
    return port, tmp_path / 'class', timer


def refuse(on):
    raise ValueError('Failed to update ASYNC_LOW_LATENCY flag')


def test_a_port_is_asked_for_low_latency_by_its_flag(adapter):
    port, tty_class, timer = adapter
    assert reduce_latency(port, tty_class) == ''
    assert timer.read_text() == '1\n'


def test_the_timer_is_written_when_the_flag_is_refused(adapter):
    port, tty_class, timer = adapter
    port.set_low_latency_mode = refuse
    assert reduce_latency(port, tty_class) == ''
    assert timer.read_text() == '1\n'


def test_a_timer_that_stays_slow_gives_a_warning_with_the_remedy(adapter):
    port, tty_class, timer = adapter
    port.set_low_latency_mode = lambda on: None

    class Stubborn(type(timer)):
        def write_text(self, *_):
            raise PermissionError

    warning = reduce_latency(port, Stubborn(tty_class))
    assert '16 ms' in warning
    assert 'ros2 run nodlidar_bringup install_udev_rules' in warning


def test_an_adapter_that_goes_away_meanwhile_is_a_port_error(adapter):
    port, tty_class, timer = adapter
    port.set_low_latency_mode = lambda on: timer.unlink()
    with pytest.raises(PortError, match='went away'):
        reduce_latency(port, tty_class)


def test_a_port_without_timer_is_left_alone(tmp_path):
    assert reduce_latency(SimpleNamespace(port='/dev/pts/3'), tmp_path) == ''
