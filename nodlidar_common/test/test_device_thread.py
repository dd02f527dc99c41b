"""The thread and its guard on a pseudo-terminal, without ROS."""

import os
import pty
import queue
import select
import signal
import threading
from types import SimpleNamespace

from nodlidar_common.device_thread import DeviceThread
from nodlidar_common.errors import DeviceError
from nodlidar_common.guard import StopRequest
from nodlidar_common.serial_port import open_port
import pytest

LONGEST = 30.0  # s; only a failing test waits so long
STOP = StopRequest('motor', b'OFF', b'OK')


@pytest.fixture
def terminal():
    ours, theirs = pty.openpty()
    yield ours, os.ttyname(theirs)
    os.close(theirs)
    os.close(ours)


class FaultyDevice:
    """A device whose first switching off is a fault of the program.

    It is unplugged once it is told to be.
    """

    def __init__(self, port):
        self.config = SimpleNamespace(port=port, baud_rate=115200, reconnect_delay=0.01)
        self.steps, self.connected, self.errors = queue.Queue(), 0, queue.Queue()
        self.unplugged = threading.Event()
        self.thread = DeviceThread(self, lambda text: None, self.errors.put)

    def connect(self):
        self.thread.open_port(0.1, STOP)
        self.connected += 1
        self.steps.put(self.connected)

    def cycle(self):
        if self.connected == 1 and self.unplugged.is_set():
            raise OSError('unplugged')
        self.thread._stop.wait(0.01)

    def disconnect(self):
        if self.connected == 1:
            self.connected = 2
            raise ZeroDivisionError('a fault of the program')


class DeafDevice:
    """A device that no longer answers once it was connected."""

    def __init__(self, port, cycles):
        self.config = SimpleNamespace(port=port, baud_rate=115200, reconnect_delay=0.01)
        self.cycles, self.tried = cycles, threading.Semaphore(0)
        self.known = False
        self.thread = DeviceThread(self, lambda text: None, lambda text: None)

    def connect(self):
        self.thread.open_port(0.1, STOP)
        if self.cycles == 0:
            self.tried.release()
            raise DeviceError('no answer')
        self.known = True

    def cycle(self):
        self.cycles -= 1
        if self.cycles == 0:
            raise DeviceError('no answer')
        self.tried.release()
        self.thread._stop.wait(0.01)

    def disconnect(self):
        if self.known:
            self.known = False
            raise DeviceError('the motor did not confirm that it is off')


@pytest.mark.parametrize('cycles', [10**6, 1])
def test_when_the_node_ends_a_guard_goes_on_with_what_did_not_confirm(terminal, cycles):
    """Whether it is connected then, or has failed and been tried again since."""
    ours, path = terminal
    device = DeafDevice(path, cycles)
    device.thread.start()
    for _ in range(3):
        assert device.tried.acquire(timeout=LONGEST)
    assert not select.select([ours], [], [], 0)[0]
    device.thread.stop()
    assert select.select([ours], [], [], LONGEST)[0]
    assert os.read(ours, 3) == b'OFF'
    os.write(ours, b'OK')


def test_what_never_was_connected_is_not_left_to_a_guard(terminal):
    ours, path = terminal
    device = DeafDevice(path, 0)
    device.thread.start()
    for _ in range(3):
        assert device.tried.acquire(timeout=LONGEST)
    device.thread.stop()
    open_port(path, 115200, 0.0).close()  # no guard holds the port
    assert not select.select([ours], [], [], 0)[0]


def test_the_guard_switches_off_what_an_error_of_the_program_left_on(
    terminal,
):
    ours, path = terminal
    device = FaultyDevice(path)
    device.unplugged.set()
    device.thread.start()
    try:
        assert device.steps.get(timeout=LONGEST) == 1
        assert select.select([ours], [], [], LONGEST)[0]
        assert os.read(ours, 3) == b'OFF'
        os.write(ours, b'OK')
        assert device.steps.get(timeout=LONGEST) == 3
    finally:
        device.thread.stop()


def test_a_guard_that_is_killed_is_replaced(terminal):
    ours, path = terminal
    device = FaultyDevice(path)
    device.thread.start()
    try:
        assert device.steps.get(timeout=LONGEST) == 1
        os.kill(device.thread._guard._process.pid, signal.SIGKILL)
        assert 'the guard of the port was killed' in device.errors.get(timeout=LONGEST)
        assert not select.select([ours], [], [], 0)[0]
        device.unplugged.set()
        assert select.select([ours], [], [], LONGEST)[0]
        assert os.read(ours, 3) == b'OFF'
        os.write(ours, b'OK')
        assert device.steps.get(timeout=LONGEST) == 3
    finally:
        device.thread.stop()
