from contextlib import ExitStack
import os
import socket
import termios
import tty

from nodlidar_common.errors import DeviceError, PortError
from nodlidar_common.serial_port import close_port, open_port, port_errors
import pytest
from serial import SerialException


@pytest.fixture
def terminal():
    """Yield the master's descriptor and the slave's path of a pseudo-terminal."""
    master, slave = os.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    os.close(master)
    os.close(slave)


def test_bytes_go_both_ways(terminal):
    master, path = terminal
    with open_port(path, 115200, timeout=5.0) as port:
        port.write(b'VV\n')
        assert os.read(master, 3) == b'VV\n'
        os.write(master, b'00P')
        assert port.read(3) == b'00P'


def test_read_ends_at_the_timeout(terminal):
    with open_port(terminal[1], 115200, timeout=0.0) as port:
        assert port.read(1) == b''


def test_second_user_is_refused_until_the_first_is_done(terminal):
    path = terminal[1]
    with open_port(path, 115200, timeout=0.0):
        with pytest.raises(PortError) as caught:
            open_port(path, 115200, timeout=0.0)
        assert str(caught.value) == (
            f"cannot open serial port '{path}': it is in use by another program"
        )
    open_port(path, 115200, timeout=0.0).close()


def test_missing_port():
    with pytest.raises(PortError, match=r"'/dev/no-lidar': it does not exist; .*plugged in"):
        open_port('/dev/no-lidar', 115200, timeout=0.0)


@pytest.mark.parametrize('address', ['192.168.0.10', 'tcp:/192.168.0.10'])
def test_an_address_that_is_taken_for_a_file_is_told_how_to_be_written(address):
    with pytest.raises(PortError, match=r'it does not exist; .* on a network is tcp://ADDRESS'):
        open_port(address, 115200, timeout=0.0)
    with pytest.raises(PortError, match=r'plugged in[?]$'):
        open_port('servo', 115200, timeout=0.0)


@pytest.mark.parametrize(
    ('address', 'reason'),
    [
        ('tcp://[::1]:1', ''),  # refused, or there is no IPv6
        ('tcp://[::1]', ''),
        ('tcp://127.0.0.1:99999', 'Port out of range'),
        ('tcp://127.0.0.1:', 'refused'),
        ('tcp://127.0.0.1:0', r'socket://127\.0\.0\.1:0: '),
    ],
)
def test_an_address_that_nobody_answers_at_is_told_with_the_reason(address, reason):
    with pytest.raises(PortError, match=reason) as caught:
        open_port(address, 115200, timeout=0.0)
    assert isinstance(caught.value.__cause__, OSError | ValueError)
    assert address in str(caught.value)


def test_a_lidar_that_takes_no_connection_holds_up_its_driver_for_a_moment_only():
    """As behind a cable that was unplugged: nothing refuses the connection."""
    with ExitStack() as open_sockets:
        full = open_sockets.enter_context(socket.socket())
        full.bind(('127.0.0.1', 0))
        full.listen(0)
        for _ in range(4):
            waiting = open_sockets.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(full.getsockname())
        with pytest.raises(PortError, match='timed out'):
            open_port(f'tcp://127.0.0.1:{full.getsockname()[1]}', 115200, timeout=0.0)


def test_file_that_is_no_port(tmp_path):
    path = tmp_path / 'file'
    path.touch()
    for wrong in (path, tmp_path, '/dev/null'):
        with pytest.raises(PortError) as caught:
            open_port(str(wrong), 115200, timeout=0.0)
        assert str(caught.value) == f"cannot open serial port '{wrong}': it is not a serial port"


def test_port_errors_are_device_errors():
    assert issubclass(PortError, DeviceError)


@pytest.mark.parametrize(
    'error', [OSError(5, 'gone'), SerialException('gone'), termios.error(5, 'gone')]
)
def test_what_a_port_that_went_away_raises_is_a_port_error(error):
    with pytest.raises(PortError, match=r'the device went away: .*gone'), port_errors():
        raise error


def test_a_port_that_went_away_can_be_closed():
    class Gone:
        def close(self):
            raise OSError(5, 'gone')

    close_port(Gone())


def test_a_device_that_takes_nothing_fails_instead_of_blocking_for_ever(terminal):
    port = open_port(terminal[1], 115200, timeout=0.0)
    with port, pytest.raises(PortError, match='Write timeout'):
        write(port, bytes(1_000_000))


def write(port, data):
    with port_errors():
        port.write(data)
